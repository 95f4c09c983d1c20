#include "server/api/codec_event.hpp"

namespace colony::server::api {
namespace {

Json vec3(const Vec3& v) { return Json::array({v.x(), v.y(), v.z()}); }

template <class T>
Json maybe(const std::optional<T>& value) {
  return value ? Json(*value) : Json(nullptr);
}
Json text_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json(text); }

Json json_or_null(const std::string& text) { return text.empty() ? Json(nullptr) : Json::parse(text); }

Json woken_list(const std::vector<Woken>& woken) {
  Json list = Json::array();
  for (const Woken& one : woken) {
    list.push_back({{"cell_id", one.cell_id.value}, {"free_share", one.free_share}, {"due_h", one.due_h}});
  }
  return list;
}

struct AddBody {
  Json& out;
  void operator()(const Founded& body) const { out["cell"] = encode_cell(body.cell); }
  void operator()(const Divided& body) const {
    out["cells"] = Json::array({encode_cell(body.cells[0]), encode_cell(body.cells[1])});
    out["plane"] = {{"point_um", vec3(body.plane_point_um)}, {"normal", vec3(body.plane_normal)}};
    out["direction"] = vec3(body.direction);
    out["fitness"] = body.fitness;
    out["evaluation_count"] = body.evaluation_count;
    out["corrected"] = body.corrected;
    out["woken"] = woken_list(body.woken);
  }
  void operator()(const Inhibited& body) const {
    out["fitness"] = body.fitness;
    out["free_share"] = body.free_share;
    out["try_count"] = body.try_count;
    out["evaluation_count"] = body.evaluation_count;
    out["corrected"] = body.corrected;
    out["due_h"] = maybe(body.due_h);
  }
  void operator()(const Settled& body) const {
    out["nucleus_um"] = vec3(body.nucleus_um);
    out["nearest_membrane_um"] = vec3(body.nearest_membrane_um);
    out["deformed_volume_um3"] = body.deformed_volume_um3;
    out["due_h"] = maybe(body.due_h);
  }
  void operator()(const Moved& body) const {
    out["cell"] = encode_cell(body.cell);
    out["woken"] = woken_list(body.woken);
  }
  void operator()(const Senesced&) const {}
  void operator()(const Finished& body) const {
    out["reason"] = name_of(body.reason);
    out["cell_count"] = body.cell_count;
  }
};

struct ToJson {
  Json operator()(std::monostate) const { return nullptr; }
  Json operator()(std::int64_t value) const { return value; }
  Json operator()(double value) const { return value; }
  Json operator()(bool value) const { return value; }
  Json operator()(const std::string& value) const { return value; }
};

}  // namespace

Json encode_field(const Field& field) { return std::visit(ToJson{}, field); }

Json encode_cell(const Cell& cell) { return encode_row(cell_columns(), cell); }

Json encode_event(const Event& event) {
  Json out = {{"seq", event.seq},
              {"time_h", event.time_h},
              {"kind", name_of(event.kind())},
              {"cell_id", event.cell_id ? Json(event.cell_id->value) : Json(nullptr)},
              {"digest", event.digest.hex()}};
  std::visit(AddBody{out}, event.body);
  return out;
}

Json encode_progress(const Progress& progress) {
  return {{"time_h", progress.time_h},
          {"cells", progress.cells},
          {"active", progress.active},
          {"passive", progress.passive},
          {"senescent", progress.senescent},
          {"fraction", maybe(progress.fraction)},
          {"cells_per_s", maybe(progress.cells_per_s)},
          {"eta_s", maybe(progress.eta_s)}};
}

namespace {

// A job but for its spec, which is stored as the text it is answered with: what stands before it, and what after.
Json encode_before_spec(const JobRow& job) {
  Json labels = Json::object();
  for (const auto& [key, value] : job.labels) labels[key] = value;
  return {{"id", job.id},
          {"kind", job.kind},
          {"name", job.name},
          {"labels", labels},
          {"state", name_of(job.state)},
          {"reason", text_or_null(job.reason)},
          {"detail", text_or_null(job.detail)},
          {"submitted_by", job.submitted_by},
          {"created_at", job.created_at},
          {"started_at", text_or_null(job.started_at)},
          {"finished_at", text_or_null(job.finished_at)},
          {"revision", job.revision},
          // The row's own pair: digest and last_seq name the same event.
          {"last_seq", job.last_seq},
          {"digest", job.digest.hex()},
          {"engine_version", job.engine_version},
          {"origin", json_or_null(job.origin_json)},
          {"result", json_or_null(job.result_json)}};
}

Json encode_after_spec(const JobView& view, std::string_view base_path) {
  const std::string self = std::string(base_path) + "/v1/jobs/" + view.job.id;
  return {{"progress", encode_progress(view.progress)},
          {"links",
           {{"self", self},
            {"events", self + "/events"},
            {"cells", self + "/cells"},
            {"series", self + "/series"},
            {"image", self + "/image"},
            {"mesh", self + "/mesh"},
            {"analysis", self + "/analysis"},
            {"lineage", self + "/lineage"},
            {"log", self + "/log"}}}};
}

}  // namespace

Json encode_job(const JobView& view, std::string_view base_path) {
  Json out = encode_before_spec(view.job);
  out["spec"] = Json::parse(view.job.spec_json);
  out.update(encode_after_spec(view, base_path));
  return out;
}

void append_job_text(std::string& out, const JobView& view, std::string_view base_path) {
  out += to_text(encode_before_spec(view.job));
  out.back() = ',';
  (out += "\"spec\":") += view.job.spec_json;
  const std::size_t joint = out.size();
  out += to_text(encode_after_spec(view, base_path));
  out[joint] = ',';
}

Json encode_log_row(const LogRow& row) {
  return {{"index", row.index}, {"at", row.at}, {"level", row.level}, {"message", row.message},
          {"actor", row.actor.empty() ? Json(nullptr) : Json(row.actor)}};
}

}  // namespace colony::server::api
