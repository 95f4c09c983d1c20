// Handlers of pictures that people send: analyse, list, show, steps, delete.
#include <algorithm>

#include "engine/analysis/reason.hpp"
#include "server/api/analyse.hpp"
#include "server/api/analysis_work.hpp"
#include "server/api/api.hpp"
#include "server/api/codec_analysis.hpp"

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
  if (const auto channel = query.integer("channel")) options.channel = static_cast<std::int64_t>(*channel);
  options.pipeline = enum_of<Pipeline>(query, "pipeline", {"auto", "nuclei", "phase", "contours"});
  options.foreground = enum_of<Foreground>(query, "foreground", {"auto", "light", "dark"});
  if (const auto threshold = query.integer("threshold")) options.threshold = static_cast<int>(*threshold);
  options.clahe = query.boolean("clahe", false);
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
    const auto measured = measure_picture(call.request.body, options, effort_of(context));
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
  const Json body = encode_analysis(*row, true);
  http::Response response = json_response(is_done ? 201 : 202, body);
  response.headers.set("Location", context.config.base_path + body["links"]["self"].get<std::string>());
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
  for (const AnalysisRow& row : page->items) items.push_back(encode_analysis(with_job(context, row), false));
  return json_response(200, {{"items", std::move(items)}, {"next", page->next ? Json(*page->next) : Json(nullptr)}});
}

http::Response removed(Context& context, const Call& call, AnalysisKind kind) {
  const Status gone = context.jobs.store().analyses().remove(kind, call.id());
  if (!gone) return failure(gone.error(), call);
  if (context.worker) context.worker->drop(call.id());
  http::Response response;
  response.status = 204;
  return response;
}

http::Response get_analyses(Context& context, const Call& call) {
  return listed(context, call, AnalysisKind::kAnalysis);
}
http::Response get_analysis(Context& context, const Call& call) {
  const auto row = context.jobs.store().analyses().find(AnalysisKind::kAnalysis, call.id());
  return row ? json_response(200, encode_analysis(*row, true)) : failure(row.error(), call);
}
http::Response delete_analysis(Context& context, const Call& call) {
  return removed(context, call, AnalysisKind::kAnalysis);
}

http::Response get_analysis_steps(Context& context, const Call& call) {
  const auto row = context.jobs.store().analyses().find(AnalysisKind::kAnalysis, call.id());
  if (!row) return failure(row.error(), call);
  return json_response(200, encode_steps(*row));
}

http::Response get_analysis_step(Context& context, const Call& call) {
  AnalysisStore& store = context.jobs.store().analyses();
  const auto row = store.find(AnalysisKind::kAnalysis, call.id());
  if (!row) return failure(row.error(), call);
  // Known from the result: nothing is computed for a name that it does not have.
  const Json steps = encode_steps(*row)["items"];
  const std::string& wanted = call.request.path_params.at(1);
  if (std::none_of(steps.begin(), steps.end(), [&](const Json& step) { return step["name"] == wanted; })) {
    std::string names;
    for (const Json& step : steps) names += (names.empty() ? "" : ", ") + step["name"].get<std::string>();
    return failure({ErrorCode::kNotFound, names.empty() ? "this analysis has no result, so it has no steps"
                                                        : "this analysis has no step of that name; there are " + names},
                   call);
  }
  const auto image = store.image(call.id());
  if (!image) return failure(image.error(), call);
  auto png = step_png(*image, decode_image_options(row->options_json), wanted,
                      effort_of(context));
  if (!png) return failure(as_body_error(png.error()), call);
  http::Response response;
  response.headers.set("Content-Type", call.media);
  response.body = std::move(*png);
  return response;
}

}  // namespace colony::server::api
