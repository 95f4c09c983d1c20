// Handlers of what is seen and measured of a colony at a time: image, mesh, analysis.
#include <algorithm>
#include <initializer_list>

#include "engine/analysis/growth_phases.hpp"
#include "engine/picture/mesh.hpp"
#include "engine/picture/ome_tiff.hpp"
#include "server/api/analysis_work.hpp"
#include "server/api/api.hpp"
#include "server/api/codec_report.hpp"
#include "server/api/glb.hpp"
#include "server/api/measure.hpp"
#include "server/api/shape_table.hpp"

namespace colony::server::api {
namespace {

template <class Enum>
Enum enum_of(const Query& query, std::string_view name, std::initializer_list<std::string_view> names) {
  const std::string value = query.text(name).value_or(std::string(*names.begin()));
  return static_cast<Enum>(std::find(names.begin(), names.end(), value) - names.begin());
}

// The scale parameters that image and analysis share; the error if both are given.
Status read_scale(const Query& query, std::int64_t width_default_px, PictureSpec& spec) {
  if (query.has("um_per_px") && query.has("width_px")) {
    return Error{ErrorCode::kInvalid,
                 "query parameters are wrong",
                 {{"um_per_px", "not together with width_px"}, {"width_px", "not together with um_per_px"}}};
  }
  spec.um_per_px = query.number("um_per_px").value_or(0.0);
  spec.width_px = width_default_px;
  if (const auto width = query.integer("width_px")) spec.width_px = static_cast<std::int64_t>(*width);
  return Ok{};
}

http::Response bytes_response(std::string_view media, std::string bytes, const std::string& tag) {
  http::Response response;
  response.headers.set("Content-Type", media);
  response.body = std::move(bytes);
  stamp(response, tag);
  return response;
}

// Growth up to the time asked for, from the curve that GET /series shows.
Result<GrowthPhases> growth_until(Context& context, const Call& call, double time_h) {
  auto rows = context.jobs.series(call.id(), kSeriesPointsDefault);
  if (!rows) return rows.error();
  std::erase_if(*rows, [&](const SeriesRow& row) { return row.time_h > time_h; });
  return growth_phases(*rows);
}

}  // namespace

http::Response csv_response(std::string text) {
  http::Response response;
  response.headers.set("Content-Type", content_type("text/csv"));
  response.body = std::move(text);
  return response;
}

http::Response get_image(Context& context, const Call& call) {
  PictureSpec spec;
  spec.style = enum_of<PictureStyle>(call.query, "style", {"shaded", "contours", "brightfield", "phase", "labels"});
  spec.colour_by = enum_of<ColourBy>(call.query, "colour_by", {"activity", "generation", "age", "volume"});
  spec.contour_lines = enum_of<ContourLines>(call.query, "lines", {"both", "colony", "cells"});
  spec.scale_bar = call.query.boolean("scale_bar", true);
  spec.side_max_px = kServedPictureSideMax_px;
  if (const Status scale = read_scale(call.query, PictureSpec().width_px, spec); !scale)
    return failure(scale.error(), call);
  const bool is_tiff = call.media == "image/tiff";
  std::vector<FieldError> errors;
  const auto refuse = [&](const char* name, bool has_meaning, const char* why) {
    if (call.query.has(name) && !has_meaning) errors.push_back({name, is_tiff ? "is not for image/tiff, which has every channel" : why});
  };
  refuse("style", !is_tiff, "");
  refuse("colour_by", !is_tiff && spec.style == PictureStyle::kShaded, "is for the style shaded alone");
  refuse("lines", !is_tiff && spec.style == PictureStyle::kContours, "is for the style contours alone");
  refuse("scale_bar", !is_tiff && spec.style != PictureStyle::kLabels, "is not for the style labels, whose every pixel is an id");
  if (!errors.empty()) return failure({ErrorCode::kInvalid, "query parameters are wrong", std::move(errors)}, call);
  if (auto settled = settled_by_history(context, call)) return std::move(*settled);
  const auto at = context.jobs.colony_at(call.id(), call.query.number("at_h"));
  if (!at) return failure(at.error(), call);
  const std::string tag = history_tag(context, call, *at);
  if (is_tiff) {
    MemoryFile file;
    const Status written = write_ome_tiff(*at->colony, at->spec->params, spec, {}, effort_of(context, call), file);
    return written ? bytes_response(call.media, file.bytes(), tag) : failure(written.error(), call);
  }
  std::string png;
  const Status drawn = render_png(*at->colony, at->spec->params, spec, effort_of(context, call),
                                  [&](std::string_view bytes) { png.append(bytes); });
  return drawn ? bytes_response(call.media, std::move(png), tag) : failure(drawn.error(), call);
}

std::int64_t mesh_triangles_default(std::size_t cell_count) {
  return std::clamp(kMeshTrianglesPerCellDefault * static_cast<std::int64_t>(cell_count), kMeshTrianglesDefaultMin, kServedMeshTrianglesMax);
}

http::Response get_mesh(Context& context, const Call& call) {
  MeshSpec spec;
  spec.nuclei = call.query.boolean("nuclei", true);
  if (auto settled = settled_by_history(context, call)) return std::move(*settled);
  const auto at = context.jobs.colony_at(call.id(), call.query.number("at_h"));
  if (!at) return failure(at.error(), call);
  const auto given = call.query.integer("triangles_max");
  spec.triangles_max = given ? static_cast<std::int64_t>(*given) : mesh_triangles_default(at->colony->cells().size());
  const auto mesh = build_mesh(*at->colony, at->spec->params.contact.rule, spec, effort_of(context, call));
  if (!mesh) return failure(mesh.error(), call);
  auto glb = encode_glb(*mesh, *at->colony);
  return glb ? bytes_response(call.media, std::move(*glb), history_tag(context, call, *at)) : failure(glb.error(), call);
}

http::Response get_analysis_of_job(Context& context, const Call& call) {
  PictureSpec spec;
  spec.side_max_px = kMeasuredSideMax_px;
  if (const Status scale = read_scale(call.query, kMeasuredWidthDefault_px, spec); !scale)
    return failure(scale.error(), call);
  // The growth of it is read off the curve of the whole job.
  const auto whole = context.jobs.moment(call.id(), std::nullopt);
  if (!whole) return failure(whole.error(), call);
  const std::string end = whole->digest.hex() + std::to_string(whole->seq);
  if (auto settled = settled_by_history(context, call, end)) return std::move(*settled);
  const auto at = context.jobs.colony_at(call.id(), call.query.number("at_h"));
  if (!at) return failure(at.error(), call);
  if (at->colony->cells().empty()) {
    return failure({ErrorCode::kNotReached, "there are no cells yet", {{"at_h", "nothing is founded yet"}}}, call);
  }
  const Effort effort = effort_of(context, call);
  const auto image = label_colony(*at->colony, spec, effort);
  if (!image) return failure(image.error(), call);
  if (call.media == "text/csv") {
    const auto rows = shape_rows(image->labels, *at->colony, image->left_um, image->top_um);
    if (!rows) return failure(rows.error(), call);
    http::Response table = csv_response(shape_csv(cell_shape_columns(), *rows));
    stamp(table, history_tag(context, call, *at, end));
    return table;
  }
  const auto report = measure_colony(*at, *image, effort);
  if (!report) return failure(report.error(), call);
  const auto packing = packing_statistics(*at->colony, at->spec->params.contact.rule, at->spec->seed,
                                          kPackingPoints, effort.threads, effort.stop);
  Json body = {{"time_h", at->time_h}, {"last_seq", at->colony->last_seq()}, {"digest", at->digest.hex()}};
  body.update(encode_report(*report));
  body["packing"] = encode_packing(packing);
  body["growth"] = encode_growth(growth_until(context, call, at->time_h));
  http::Response response = json_response(200, body);
  const auto later = context.jobs.moment(call.id(), std::nullopt);
  if (later && later->seq == whole->seq) stamp(response, history_tag(context, call, *at, end));
  return response;
}

}  // namespace colony::server::api
