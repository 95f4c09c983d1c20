#include "server/api/codec_model.hpp"

#include <algorithm>
#include <cmath>

#include "server/api/suggest.hpp"

namespace colony::server::api {
namespace {

constexpr std::string_view kPositions = "founders.positions_um";

// Reads one parameter; a value of the wrong type is an error and leaves the parameter as it was.
class ReadParam {
 public:
  ReadParam(const Json& json, const std::string& pointer, Params& params, std::vector<FieldError>& errors)
      : json_(json), pointer_(pointer), params_(params), errors_(errors) {}

  void operator()(Access<double> access) const {
    if (json_.is_number())
      access(params_) = json_.get<double>();
    else
      add("must be a number");
  }
  void operator()(Access<std::int64_t> access) const {
    if (const auto value = integer_of(json_))
      access(params_) = *value;
    else
      add("must be an integer");
  }
  void operator()(Access<bool> access) const {
    if (json_.is_boolean())
      access(params_) = json_.get<bool>();
    else
      add("must be true or false");
  }
  void operator()(Access<std::optional<double>> access) const {
    if (json_.is_null())
      access(params_).reset();
    else if (json_.is_number())
      access(params_) = json_.get<double>();
    else
      add("must be a number or null");
  }
  void operator()(Access<std::optional<std::int64_t>> access) const {
    const auto value = integer_of(json_);
    if (json_.is_null())
      access(params_).reset();
    else if (value)
      access(params_) = *value;
    else
      add("must be an integer or null");
  }
  void operator()(Access<Interval> access) const {
    double ends[2];
    if (read_pair(json_, ends))
      access(params_) = Interval{ends[0], ends[1]};
    else
      add("must be a pair of numbers [low, high]");
  }
  void operator()(const EnumAccess& access) const {
    std::string names;
    for (const std::string_view name : access.names) names += (names.empty() ? "" : ", ") + std::string(name);
    if (!json_.is_string()) return add("must be one of " + names);
    const std::string& value = json_.get_ref<const std::string&>();
    const auto found = std::find(access.names.begin(), access.names.end(), value);
    if (found == access.names.end()) return add("must be one of " + names + suggestion(value, access.names));
    access.set(params_, static_cast<int>(found - access.names.begin()));
  }
  void operator()(Access<std::vector<Vec2>> access) const {
    if (!json_.is_array() || json_.empty()) return add("must be a list of one or more positions [x, y]");
    std::vector<Vec2> positions;
    positions.reserve(json_.size());
    for (std::size_t i = 0; i < json_.size(); ++i) {
      double ends[2];
      if (read_pair(json_[i], ends))
        positions.emplace_back(ends[0], ends[1]);
      else
        errors_.push_back({child_pointer(pointer_, std::to_string(i)), "must be a pair of numbers [x, y]"});
    }
    if (positions.size() == json_.size()) access(params_) = std::move(positions);
  }

 private:
  static bool read_pair(const Json& json, double (&out)[2]) {
    if (!json.is_array() || json.size() != 2 || !json[0].is_number() || !json[1].is_number()) return false;
    out[0] = json[0].get<double>();
    out[1] = json[1].get<double>();
    return true;
  }
  void add(std::string message) const { errors_.push_back({pointer_, std::move(message)}); }

  const Json& json_;
  const std::string& pointer_;
  Params& params_;
  std::vector<FieldError>& errors_;
};

struct WriteParam {
  Params& params;
  Json operator()(Access<double> access) const { return access(params); }
  Json operator()(Access<std::int64_t> access) const { return access(params); }
  Json operator()(Access<bool> access) const { return access(params); }
  Json operator()(Access<Interval> access) const { return Json::array({access(params).low, access(params).high}); }
  Json operator()(Access<std::optional<double>> access) const {
    return access(params) ? Json(*access(params)) : Json(nullptr);
  }
  Json operator()(Access<std::optional<std::int64_t>> access) const {
    return access(params) ? Json(*access(params)) : Json(nullptr);
  }
  Json operator()(const EnumAccess& access) const { return access.names[static_cast<std::size_t>(access.get(params))]; }
  Json operator()(Access<std::vector<Vec2>> access) const {
    Json list = Json::array();
    for (const Vec2& position : access(params)) list.push_back(Json::array({position.x(), position.y()}));
    return list;
  }
};

std::string_view group_of(std::string_view path) {
  const std::size_t dot = path.find('.');
  return dot == std::string_view::npos ? std::string_view() : path.substr(0, dot);
}
std::string_view leaf_of(std::string_view path) {
  const std::size_t dot = path.find('.');
  return dot == std::string_view::npos ? path : path.substr(dot + 1);
}

const ParamInfo* find_param(std::string_view group, std::string_view leaf) {
  for (const ParamInfo& info : param_table()) {
    if (group_of(info.path) == group && leaf_of(info.path) == leaf) return &info;
  }
  return nullptr;
}

// Names that can stand in `group` ("" = directly in the model), without repeats.
std::vector<std::string_view> names_in(std::string_view group) {
  std::vector<std::string_view> names;
  for (const ParamInfo& info : param_table()) {
    const std::string_view own = group_of(info.path);
    std::string_view name;
    if (own == group)
      name = leaf_of(info.path);
    else if (group.empty())
      name = own;
    if (!name.empty() && std::find(names.begin(), names.end(), name) == names.end()) names.push_back(name);
  }
  return names;
}

std::string unknown_field(std::string_view group, std::string_view name) {
  // The right name in the wrong group is the most likely slip: name it with its group.
  for (const ParamInfo& info : param_table()) {
    if (name == leaf_of(info.path)) return "unknown field, did you mean model." + std::string(info.path) + "?";
  }
  return "unknown field" + suggestion(name, names_in(group));
}

void decode_group(std::string_view group, const Json& json, const std::string& pointer, Params& params,
                  std::vector<FieldError>& errors) {
  if (!json.is_object()) {
    errors.push_back({pointer, "must be an object"});
    return;
  }
  for (const auto& [name, value] : json.items()) {
    const std::string at = child_pointer(pointer, name);
    if (const ParamInfo* info = find_param(group, name)) {
      std::visit(ReadParam(value, at, params, errors), info->access);
    } else if (const auto names = names_in("");
               group.empty() && std::find(names.begin(), names.end(), name) != names.end()) {
      decode_group(name, value, at, params, errors);
    } else {
      errors.push_back({at, unknown_field(group, name)});
    }
  }
}

}  // namespace

void decode_model(const Json& model, const std::string& pointer, Params& params, std::vector<FieldError>& errors) {
  const std::size_t before = errors.size();
  decode_group("", model, pointer, params, errors);
  if (model.is_object() && model.contains("founders") && model["founders"].is_object()) {
    const Json& founders = model["founders"];
    if (founders.contains("positions_um") && (founders.contains("count") || founders.contains("radius_um"))) {
      errors.push_back({child_pointer(pointer, "founders"), "takes positions_um, or count and radius_um, not both"});
    }
  }

  std::vector<FieldError> known;  // with pointers as validate() has them, from the model object on
  for (std::size_t i = before; i < errors.size(); ++i) {
    known.push_back({errors[i].pointer.substr(pointer.size()), errors[i].message});
  }
  for (FieldError& error : validate(params, known)) errors.push_back({pointer + error.pointer, std::move(error.message)});
}

Json encode_param(const ParamInfo& info, const Params& params) {
  Params copy = params;  // accessors give mutable references
  return std::visit(WriteParam{copy}, info.access);
}

Json encode_model(const Params& params) {
  Json model = Json::object();
  const bool has_positions = !params.founders.positions_um.empty();
  for (const ParamInfo& info : param_table()) {
    const std::string_view group = group_of(info.path);
    // Founders are given in one of two ways; only the one that counts is written.
    if (group == "founders" && (info.path == kPositions) != has_positions) continue;
    Json& parent = group.empty() ? model : model[std::string(group)];
    parent[std::string(leaf_of(info.path))] = encode_param(info, params);
  }
  return model;
}

}  // namespace colony::server::api
