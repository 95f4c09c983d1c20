// Handlers of pictures that people send: analyse, list, show, steps, delete.
#include <algorithm>

#include "engine/analysis/reason.hpp"
#include "server/api/analyse.hpp"
#include "server/api/analysis_work.hpp"
#include "server/api/api.hpp"
#include "server/api/codec_analysis.hpp"
#include "server/api/codec_event.hpp"
#include "server/api/kept.hpp"
#include "server/api/shape_table.hpp"

namespace colony::server::api {
namespace {

template <class Enum>
Enum enum_of(const Query& query, std::string_view name, std::initializer_list<std::string_view> names) {
  const std::string value = query.text(name).value_or(std::string(*names.begin()));
  return static_cast<Enum>(std::find(names.begin(), names.end(), value) - names.begin());
}

ImageOptions options_of(const Query& query) {
  ImageOptions options;
  options.um_per_px = query.number("um_per_px");
  const auto whole = [&](const char* name) -> std::optional<std::int64_t> {
    const auto value = query.integer(name);
    return value ? std::optional(static_cast<std::int64_t>(*value)) : std::nullopt;
  };
  options.channel = whole("channel");
  options.pipeline = enum_of<Pipeline>(query, "pipeline", {"auto", "nuclei", "phase", "contours"});
  options.foreground = enum_of<Foreground>(query, "foreground", {"auto", "light", "dark"});
  if (const auto threshold = query.integer("threshold")) options.threshold = static_cast<int>(*threshold);
  options.clahe = query.boolean("clahe", false);
  options.split = query.boolean("split", true);
  options.area_min_px = whole("area_min_px");
  options.hole_max_px = whole("hole_max_px");
  options.background_reach_px = whole("background_reach_px");
  options.window_radius_px = whole("window_radius_px").value_or(options.window_radius_px);
  return options;
}

// The bytes decide; a header that says otherwise is a mistake worth telling.
Result<ImageFormat> format_of(const http::Request& request) {
  if (request.body.empty()) {
    return Error{ErrorCode::kMalformed, "the body is empty: it must be the image", {{"", "must be the bytes of an image"}}};
  }
  const auto format = sniff_image(request.body);
  if (!format) {
    return Error{ErrorCode::kMalformed,
                 "the body is no PNG, TIFF or JPEG: its first bytes are those of none of them",
                 {{"", "must be the bytes of a PNG, TIFF or JPEG image"}}};
  }
  const std::string declared(request.headers.get("Content-Type").value_or(""));
  if (declared != media_type(*format)) {
    return Error{ErrorCode::kInvalid,
                 "the body is " + std::string(media_type(*format)) + ", not what Content-Type says",
                 {{"Content-Type", "says " + declared + ", but the body is " + std::string(media_type(*format))}}};
  }
  return *format;
}

// What the engine calls `image` is the body. What a decoder says is about all of it.
Error as_body_error(Error error) {
  if (error.fields.empty() && error.code != ErrorCode::kInternal) error.fields = {{"image", error.message}};
  error.message = reason_of(error);
  for (FieldError& field : error.fields) {
    if (field.pointer == "image") field.pointer = "";
  }
  return error;
}

}  // namespace

std::vector<QueryParam> analysis_params() {
  constexpr double kObjectAreaMax_px = kImageSideMax_px * kImageSideMax_px;
  return {{"name", QueryType::kText, 0, 0, {}, "a name for people"},
          {"um_per_px", QueryType::kNumber, kImageScaleMin_um_per_px, kImageScaleMax_um_per_px, {},
           "size of a pixel; without it lengths are in pixels"},
          {"foreground", QueryType::kName, 0, 0, {"auto", "light", "dark"}, "what the objects are; default auto"},
          {"channel", QueryType::kInteger, 0, 15, {}, "from 0; an image of several channels needs one"},
          {"threshold", QueryType::kInteger, 0, 254, {}, "of the step `signal`; default by Otsu"},
          {"pipeline", QueryType::kName, 0, 0, {"auto", "nuclei", "phase", "contours"}, "default auto"},
          {"clahe", QueryType::kBoolean, 0, 0, {}, "even the local contrast first; default false"},
          {"split", QueryType::kBoolean, 0, 0, {}, "nuclei: part touching objects; default true"},
          {"area_min_px", QueryType::kInteger, 1, kObjectAreaMax_px, {}, "the smallest object; default by the picture"},
          {"hole_max_px", QueryType::kInteger, 0, kObjectAreaMax_px, {}, "the largest hole that is filled; default by the picture"},
          {"background_reach_px", QueryType::kInteger, 3, kImageSideMax_px, {},
           "nuclei: wider than any object; default a quarter of the shorter side"},
          {"window_radius_px", QueryType::kInteger, 1, 50, {}, "phase: of the local deviation; default 3"}};
}

http::Response post_analysis(Context& context, const Call& call) {
  NewAnalysis analysis;
  analysis.name = call.query.text("name").value_or("");
  if (const std::string wrong = name_error(analysis.name); !wrong.empty()) {
    return failure({ErrorCode::kInvalid, "query parameters are wrong", {{"name", wrong}}}, call);
  }
  const auto format = format_of(call.request);
  if (!format) return failure(format.error(), call);
  const ImageOptions options = options_of(call.query);
  std::int64_t pixels = 0;
  {
    // Also of what is put off: an image that cannot be read is told at once.
    DecodeLimits limits = AnalysisOptions().limits;
    limits.side_max_px = std::min(limits.side_max_px, kImageSideMax_px);
    const auto decoded = decode_image(call.request.body, limits);
    if (!decoded) return failure(as_body_error(decoded.error()), call);
    if (options.channel && *options.channel >= decoded->channel_count) {
      return failure({ErrorCode::kInvalid,
                      "query parameters are wrong",
                      {{"channel", "the image has " + std::to_string(decoded->channel_count) + " channels, from 0"}}},
                     call);
    }
    pixels = decoded->pixel_count();
  }
  if (pixels <= kAnalysedAtOncePixelsMax) {
    const auto measured = measure_picture(call.request.body, options, effort_of(context, call));
    if (!measured) return failure(as_body_error(measured.error()), call);
    analysis.result_json = to_text(encode_picture_result(*measured));
  }
  analysis.options_json = to_text(encode_image_options(options));
  analysis.media_type = media_type(*format);
  analysis.image = call.request.body;
  return created(context, call, analysis);
}

http::Response created(Context& context, const Call& call, const NewAnalysis& analysis) {
  const AnalysisLimits limits{context.config.stored_image_bytes_max, context.config.analyses_waiting_max};
  const auto row = context.jobs.store().analyses().create(analysis, limits);
  if (!row) return failure(row.error(), call);
  const bool is_done = row->state == AnalysisState::kSucceeded;
  if (!is_done && context.worker) context.worker->nudge();
  const Json body = encode_analysis(*row, true, context.config.base_path);
  http::Response response = json_response(is_done ? 201 : 202, body);
  response.headers.set("Location", body["links"]["self"].get<std::string>());
  return response;
}

AnalysisRow with_job(Context& context, AnalysisRow row) {
  if (row.kind == AnalysisKind::kComparison && row.has_source) row.has_source = static_cast<bool>(context.jobs.show(row.job_id));
  return row;
}

http::Response listed(Context& context, const Call& call, AnalysisKind kind) {
  const std::size_t limit = call.query.integer("limit").value_or(kJobsPerPageDefault);
  const auto cursor = call.query.text("cursor");
  if (cursor && cursor->empty()) {
    return failure(
        {ErrorCode::kInvalid, "query parameters are wrong", {{"cursor", "must be `next` of the page before"}}}, call);
  }
  const auto page = context.jobs.store().analyses().list(kind, limit, cursor.value_or(""));
  if (!page) return failure(page.error(), call);
  Json items = Json::array();
  for (const AnalysisRow& row : page->items) items.push_back(encode_analysis(with_job(context, row), false, context.config.base_path));
  http::Response response =
      json_response(200, {{"items", std::move(items)}, {"next", page->next ? Json(*page->next) : Json(nullptr)}});
  if (page->next) set_next_link(context, call, response, "cursor", *page->next);
  return response;
}

http::Response removed(Context& context, const Call& call, AnalysisKind kind) {
  const Status gone = context.jobs.store().analyses().remove(kind, call.id());
  if (!gone) return failure(gone.error(), call);
  if (context.worker) context.worker->drop(call.id());
  context.kept->drop(call.id());
  http::Response response;
  response.status = 204;
  return response;
}

http::Response get_analyses(Context& context, const Call& call) {
  return listed(context, call, AnalysisKind::kAnalysis);
}
http::Response get_analysis(Context& context, const Call& call) {
  const auto row = context.jobs.store().analyses().find(AnalysisKind::kAnalysis, call.id());
  return row ? json_response(200, encode_analysis(*row, true, context.config.base_path)) : failure(row.error(), call);
}
http::Response delete_analysis(Context& context, const Call& call) {
  return removed(context, call, AnalysisKind::kAnalysis);
}

http::Response get_analysis_objects(Context& context, const Call& call) {
  AnalysisStore& store = context.jobs.store().analyses();
  const auto row = store.find(AnalysisKind::kAnalysis, call.id());
  if (!row) return failure(row.error(), call);
  // An analysis has one image and one set of options for ever.
  const std::string tag = derived_tag(context, call, Digest{}, 0, row->id + " " + row->options_json);
  if (auto settled = settled_by_tag(call, tag)) return std::move(*settled);
  if (auto kept = context.kept->find(tag)) return std::move(*kept);
  const auto image = store.image(call.id());
  if (!image) return failure(image.error(), call);
  const auto objects = objects_of_picture(*image, decode_image_options(row->options_json), effort_of(context, call));
  if (!objects) return failure(as_body_error(objects.error()), call);
  const auto rows = shape_rows(*objects);
  if (!rows) return failure(as_body_error(rows.error()), call);
  http::Response response;
  if (call.media == "text/csv") {
    response = csv_response(shape_csv(object_shape_columns(), *rows));
  } else {
    Json items = Json::array();
    for (const ShapeRow& object : *rows) items.push_back(encode_row(object_shape_columns(), object));
    response = json_response(200, {{"items", std::move(items)}, {"next", nullptr}});
  }
  stamp(response, tag);
  context.kept->keep(tag, {row->id}, response);
  return response;
}

http::Response get_analysis_steps(Context& context, const Call& call) {
  const auto row = context.jobs.store().analyses().find(AnalysisKind::kAnalysis, call.id());
  if (!row) return failure(row.error(), call);
  return json_response(200, encode_steps(*row, context.config.base_path));
}

http::Response get_analysis_step(Context& context, const Call& call) {
  AnalysisStore& store = context.jobs.store().analyses();
  const auto row = store.find(AnalysisKind::kAnalysis, call.id());
  if (!row) return failure(row.error(), call);
  // Known from the result: nothing is computed for a name that it does not have.
  const Json steps = encode_steps(*row, context.config.base_path)["items"];
  const std::string& wanted = call.request.path_params.at(1);
  if (std::none_of(steps.begin(), steps.end(), [&](const Json& step) { return step["name"] == wanted; })) {
    std::string names;
    for (const Json& step : steps) names += (names.empty() ? "" : ", ") + step["name"].get<std::string>();
    return failure({ErrorCode::kNotFound, names.empty() ? "this analysis has no result, so it has no steps"
                                                        : "this analysis has no step of that name; there are " + names},
                   call);
  }
  // An analysis has one image and one set of options for ever.
  const std::string tag = derived_tag(context, call, Digest{}, 0, row->id + " " + row->options_json + " " + wanted);
  if (auto settled = settled_by_tag(call, tag)) return std::move(*settled);
  if (auto kept = context.kept->find(tag)) return std::move(*kept);
  const auto image = store.image(call.id());
  if (!image) return failure(image.error(), call);
  auto png = step_png(*image, decode_image_options(row->options_json), wanted, effort_of(context, call));
  if (!png) return failure(as_body_error(png.error()), call);
  http::Response response;
  response.headers.set("Content-Type", call.media);
  response.body = std::move(*png);
  stamp(response, tag);
  context.kept->keep(tag, {row->id}, response);
  return response;
}

}  // namespace colony::server::api
