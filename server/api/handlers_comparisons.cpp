// Handlers of comparisons: a colony at a time against a picture that was sent.
#include "engine/analysis/reason.hpp"
#include "server/api/analysis_work.hpp"
#include "server/api/api.hpp"
#include "server/api/codec_analysis.hpp"
#include "server/api/compare.hpp"
#include "server/api/kept.hpp"

namespace colony::server::api {
namespace {

// The analysis as the comparison needs it: its options and its image.
struct Source {
  AnalysisRow row;
  std::string image;
};

Result<Source> source_of(Context& context, const std::string& id) {
  AnalysisStore& store = context.jobs.store().analyses();
  auto row = store.find(AnalysisKind::kAnalysis, id);
  if (!row) return row.error();
  auto image = store.image(id);
  if (!image) return image.error();
  return Source{std::move(*row), std::move(*image)};
}

// What the stored result says of the picture; what an older program stored calls all objects cells.
ObjectFacts facts_of(const Json& result) {
  ObjectFacts facts;
  const std::string kind = result.value("object_kind", "cells");
  for (const ObjectKind one : {ObjectKind::kCells, ObjectKind::kNuclei, ObjectKind::kRegions, ObjectKind::kObjects}) {
    if (kind == name_of(one)) facts.kind = one;
  }
  const bool is_old = !result.contains("object_kind");
  facts.count = result[is_old ? "cell_count" : "object_count"].get<std::uint64_t>();
  facts.area_mean_px = result[is_old ? "cell_area_mean_px" : "object_area_mean_px"].get<double>();
  if (!result["image"]["um_per_px"].is_null()) facts.um_per_px = result["image"]["um_per_px"].get<double>();
  return facts;
}

Error gone_with(const char* pointer, Error error) {
  error.fields = {{pointer, error.message}};
  if (error.code == ErrorCode::kNotFound) error.code = ErrorCode::kInvalid;  // the resource is there, what it names is not
  return error;
}

Result<Comparison> compare_again(Context& context, const AnalysisRow& row, const Effort& effort, Sweep sweep) {
  auto found = source_of(context, row.analysis_id);
  if (!found) return found.error();
  auto at = context.jobs.colony_at(row.job_id, Json::parse(row.options_json)["at_h"].get<double>());
  if (!at) return at.error();
  return compare(std::move(*at), found->image, decode_image_options(found->row.options_json), decode_match_request(row.options_json),
                 effort, sweep);
}

}  // namespace

AnalysisWorker::Outcome work_on(Context& context, const AnalysisRow& row, StopFlag stop) {
  const Effort effort{context.config.jobs.threads_per_job, stop};
  const auto failed = [](const Error& error) {
    return AnalysisWorker::Outcome{{}, std::string(problem_row(problem_kind_of(error.code)).code), reason_of(error)};
  };
  if (row.kind == AnalysisKind::kComparison) {
    const auto comparison = compare_again(context, row, effort, Sweep::kMake);
    if (!comparison) return failed(comparison.error());
    return {to_text(encode_comparison(*comparison)), {}, {}};
  }
  const auto image = context.jobs.store().analyses().image(row.id);
  if (!image) return failed(image.error());
  const auto measured = measure_picture(*image, decode_image_options(row.options_json), effort);
  if (!measured) return failed(measured.error());
  return {to_text(encode_picture_result(*measured)), {}, {}};
}

Effort effort_of(const Context& context, const Call& call) { return {context.config.jobs.threads_per_job, call.stop(context)}; }

http::Response post_comparison(Context& context, const Call& call) {
  const auto body = parse_json(call.request.body);
  if (!body) return failure(body.error(), call);
  const auto spec = decode_comparison_spec(*body);
  if (!spec) return failure(spec.error(), call);
  const auto source = source_of(context, spec->analysis_id);
  if (!source) return failure(gone_with("/analysis_id", source.error()), call);
  if (source->row.state != AnalysisState::kSucceeded) {
    return failure({ErrorCode::kInvalid,
                    "the analysis has no result",
                    {{"/analysis_id", "the analysis is " + std::string(name_of(source->row.state))}}},
                   call);
  }
  auto at = context.jobs.colony_at(spec->job_id, spec->at_h);
  if (!at) return failure(gone_with(spec->at_h && at.error().code != ErrorCode::kNotFound ? "/at_h" : "/job_id", at.error()), call);
  NewAnalysis comparison;
  comparison.kind = AnalysisKind::kComparison;
  comparison.name = spec->name;
  comparison.job_id = spec->job_id;
  comparison.analysis_id = spec->analysis_id;
  // Of a job that goes on: the moment as it is now, so that the figure is of the same colony later.
  Json options = encode_match_request(spec->match);
  options["at_h"] = at->time_h;
  comparison.options_json = to_text(options);
  const Json stored = Json::parse(source->row.result_json);
  const Json& image = stored["image"];
  const std::int64_t pixels = image["width_px"].get<std::int64_t>() * image["height_px"].get<std::int64_t>();
  const auto match = match_of(spec->match, facts_of(stored));
  if (!match) return failure(match.error(), call);
  // Either may be the large one: a small picture of large cells asks for a large picture of the colony.
  const bool is_small = pixels <= kAnalysedAtOncePixelsMax && at->colony->cells().size() <= kComparedAtOnceCellsMax &&
                        compared_px_estimate(*at->colony, *match) <= kComparedAtOncePixelsMax;
  if (is_small) {
    const auto made = compare(std::move(*at), source->image, decode_image_options(source->row.options_json), spec->match,
                              effort_of(context, call));
    if (!made) return failure(made.error(), call);
    comparison.result_json = to_text(encode_comparison(*made));
  }
  return created(context, call, comparison);
}

http::Response get_comparisons(Context& context, const Call& call) {
  return listed(context, call, AnalysisKind::kComparison);
}
http::Response get_comparison(Context& context, const Call& call) {
  const auto row = context.jobs.store().analyses().find(AnalysisKind::kComparison, call.id());
  if (!row) return failure(row.error(), call);
  return json_response(200, encode_analysis(with_job(context, *row), true, context.config.base_path));
}
http::Response delete_comparison(Context& context, const Call& call) {
  return removed(context, call, AnalysisKind::kComparison);
}

http::Response get_comparison_figure(Context& context, const Call& call) {
  const auto row = context.jobs.store().analyses().find(AnalysisKind::kComparison, call.id());
  if (!row) return failure(row.error(), call);
  const auto source = context.jobs.store().analyses().find(AnalysisKind::kAnalysis, row->analysis_id);
  if (!source) return failure(source.error(), call);
  const auto moment = context.jobs.moment(row->job_id, Json::parse(row->options_json)["at_h"].get<double>());
  if (!moment) return failure(moment.error(), call);
  const std::string tag = derived_tag(context, call, moment->digest, moment->seq, row->id + " " + source->options_json);
  if (auto settled = settled_by_tag(call, tag)) return std::move(*settled);
  if (auto kept = context.kept->find(tag)) return std::move(*kept);
  const Effort effort = effort_of(context, call);
  const auto comparison = compare_again(context, *row, effort, Sweep::kLeaveOut);
  if (!comparison) return failure(comparison.error(), call);
  http::Response response;
  response.headers.set("Content-Type", call.media);
  response.body = comparison_figure(*comparison, effort.stop);
  stamp(response, tag);
  context.kept->keep(tag, {row->id, row->analysis_id, row->job_id}, response);
  return response;
}

}  // namespace colony::server::api
