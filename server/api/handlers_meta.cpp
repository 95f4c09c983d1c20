// Handlers of what the server says about itself.
#include "engine/picture/render.hpp"
#include "server/api/api.hpp"
#include "server/api/measure.hpp"
#include "server/api/codec_model.hpp"
#include "server/api/docs.hpp"
#include "server/api/schema.hpp"

namespace colony::server::api {
namespace {

http::Response text_response(std::string_view media, const std::string& body) {
  http::Response response;
  response.headers.set("Content-Type", media);
  response.body = body;
  return response;
}

Json parameter_facts(const ParamInfo& info, const Params& paper) {
  Json facts = {{"path", info.path}, {"unit", info.unit}, {"type", param_type_name(info)}};
  if (const auto* names = std::get_if<EnumAccess>(&info.access)) {
    facts["values"] = names->names;
  } else if (!std::holds_alternative<Access<bool>>(info.access)) {
    facts["min"] = info.min;
    facts["max"] = info.max;
  }
  if (info.power_of_two) facts["power_of_two"] = true;
  facts["default"] = encode_param(info, paper);
  facts["text"] = info.text;
  return facts;
}

}  // namespace

http::Response get_job_schema(Context& context, const Call& call) {
  return text_response(call.media, context.schema_text);
}
http::Response get_openapi(Context& context, const Call& call) {
  return text_response(call.media, context.openapi_text);
}

http::Response get_docs(Context& context, const Call& call) {
  // The address as the reader has it: Host has passed the gate. What a proxy says of the scheme can mislead none but who asks.
  const http::Headers& headers = call.request.headers;
  const bool is_https = context.config.is_encrypted ||
                        (context.config.is_behind_proxy && headers.get("X-Forwarded-Proto").value_or("") == "https");
  const std::string address = std::string(is_https ? "https://" : "http://") +
                              std::string(headers.get("Host").value_or("127.0.0.1:8080")) + context.config.base_path;
  http::Response response = text_response(std::string(call.media) + "; charset=utf-8", docs_at(context.docs_text, address));
  // The page is text and one style: nothing else may run or be fetched.
  response.headers.set("Content-Security-Policy",
                       "default-src 'none'; style-src 'self'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'");
  return response;
}
http::Response get_docs_style(Context&, const Call& call) {
  return text_response(std::string(call.media) + "; charset=utf-8", std::string(docs_style()));
}

http::Response get_service_info(Context& context, const Call&) {
  const ApiConfig& config = context.config;
  Json presets = Json::array();
  for (const std::string_view name : preset_names()) {
    presets.push_back({{"name", name}, {"text", preset_text(name)}, {"model", encode_model(*preset(name))}});
  }
  Json parameters = Json::array();
  const Params paper = *preset(kPresetDefault);
  for (const ParamInfo& info : param_table()) parameters.push_back(parameter_facts(info, paper));
  return json_response(200, {{"name", "colonyd"},
                             {"version", config.version},
                             {"limits",
                              {{"jobs_concurrent_max", config.jobs.concurrent_max},
                               {"jobs_threads_per_job", config.jobs.threads_per_job},
                               {"jobs_queued_max", config.jobs.queued_max},
                               {"cells_max", config.jobs.cells_max},
                               {"events_max", config.jobs.events_max},
                               {"body_bytes_max", config.body_bytes_max},
                               {"image_bytes_max", config.image_bytes_max},
                               {"stored_image_bytes_max", config.stored_image_bytes_max},
                               {"analyses_waiting_max", config.analyses_waiting_max},
                               {"header_bytes_max", config.header_bytes_max},
                               {"connections_max", config.connections_max},
                               {"json_depth_max", kJsonDepthMax},
                               {"jobs_per_page_max", kJobsPerPageMax},
                               {"events_per_page_max", kEventsPerPageMax},
                               {"series_points_max", kSeriesPointsMax},
                               {"picture_side_max_px", kServedPictureSideMax_px},
                               {"mesh_triangles_max", kServedMeshTrianglesMax},
                               {"measured_side_max_px", kMeasuredSideMax_px},
                               {"labels_max", kLabelsMax},
                               {"seed_max", kSeedMax},
                               {"until_time_max_h", kUntilTimeMax_h}}},
                             {"presets", presets},
                             {"parameters", parameters}});
}

http::Response get_healthz(Context&, const Call&) { return json_response(200, {{"status", "ok"}}); }

http::Response get_readyz(Context& context, const Call& call) {
  if (context.draining) {
    return problem_response({ErrorCode::kUnavailable, "the server is draining"}, call.request.request_id);
  }
  const Status writable = context.jobs.store().check_writable(context.config.disk_free_bytes_min);
  if (!writable) return problem_response(writable.error(), call.request.request_id);
  return json_response(200, {{"status", "ready"}});
}

}  // namespace colony::server::api
