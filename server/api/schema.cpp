#include "server/api/schema.hpp"

#include <cmath>

#include "server/api/codec_model.hpp"

namespace colony::server::api {
namespace {

Json integer_or_number(double value) {
  return value == std::floor(value) && std::fabs(value) <= 9e15 ? Json(static_cast<std::int64_t>(value)) : Json(value);
}

Json number(const char* type, const ParamInfo& info, bool nullable) {
  return {{"type", nullable ? Json::array({type, "null"}) : Json(type)},
          {"minimum", integer_or_number(info.min)},
          {"maximum", integer_or_number(info.max)}};
}

Json pair_of(const ParamInfo& info) {
  return {{"type", "array"}, {"items", number("number", info, false)}, {"minItems", 2}, {"maxItems", 2}};
}

struct ParamSchema {
  const ParamInfo& info;
  Json operator()(Access<double>) const { return number("number", info, false); }
  Json operator()(Access<std::int64_t>) const {
    if (!info.power_of_two) return number("integer", info, false);
    Json values = Json::array();
    for (std::int64_t value = 1; static_cast<double>(value) <= info.max; value *= 2) {
      if (static_cast<double>(value) >= info.min) values.push_back(value);
    }
    return {{"type", "integer"}, {"enum", values}};
  }
  Json operator()(Access<bool>) const { return {{"type", "boolean"}}; }
  Json operator()(Access<Interval>) const { return pair_of(info); }
  Json operator()(Access<std::optional<double>>) const { return number("number", info, true); }
  Json operator()(Access<std::optional<std::int64_t>>) const { return number("integer", info, true); }
  Json operator()(const EnumAccess& access) const { return {{"type", "string"}, {"enum", access.names}}; }
  Json operator()(Access<std::vector<Vec2>>) const {
    return {{"type", "array"}, {"items", pair_of(info)}, {"minItems", 1}, {"maxItems", kFoundersMax}};
  }
};

struct TypeName {
  std::string operator()(Access<double>) const { return "number"; }
  std::string operator()(Access<std::int64_t>) const { return "integer"; }
  std::string operator()(Access<bool>) const { return "boolean"; }
  std::string operator()(Access<Interval>) const { return "[low, high]"; }
  std::string operator()(Access<std::optional<double>>) const { return "number or null"; }
  std::string operator()(Access<std::optional<std::int64_t>>) const { return "integer or null"; }
  std::string operator()(const EnumAccess&) const { return "name"; }
  std::string operator()(Access<std::vector<Vec2>>) const { return "[[x, y], ...]"; }
};

Json until_schema(const SpecLimits& limits) {
  return {{"type", "object"},
          {"description", "bounds; at least one. cells alone imply time_h 10000"},
          {"properties",
           {{"time_h", {{"type", "number"}, {"exclusiveMinimum", 0}, {"maximum", kUntilTimeMax_h}}},
            {"cells", {{"type", "integer"}, {"minimum", 1}, {"maximum", limits.cells_max}}}}},
          {"minProperties", 1},
          {"additionalProperties", false}};
}

Json seed_schema() { return {{"type", "integer"}, {"minimum", 0}, {"maximum", kSeedMax}, {"default", kSeedDefault}}; }
Json preset_schema() { return {{"type", "string"}, {"enum", preset_names()}, {"default", kPresetDefault}}; }

Json name_schema() {
  return {{"type", "string"}, {"maxLength", kNameCharactersMax}, {"pattern", "^[^\\u0000-\\u001f\\u007f-\\u009f]*$"}};
}
}  // namespace

Json labels_schema() {
  return {
      {"type", "object"},
      {"maxProperties", kLabelsMax},
      {"propertyNames", {{"pattern", "^[a-z0-9_.-]{1,63}$"}}},
      // A length in characters is a necessary bound only: the codec counts bytes.
      {"additionalProperties",
       {{"type", "string"}, {"maxLength", kLabelValueBytesMax}, {"pattern", "^[^\\u0000-\\u001f\\u007f-\\u009f]*$"}}}};
}

std::string param_type_name(const ParamInfo& info) { return std::visit(TypeName{}, info.access); }

Json strict_object(Json properties) {
  Json required = Json::array();
  for (const auto& [name, schema] : properties.items()) required.push_back(name);
  return {{"type", "object"},
          {"properties", std::move(properties)},
          {"required", required},
          {"additionalProperties", false}};
}

Json reference(std::string_view component) { return {{"$ref", "#/components/schemas/" + std::string(component)}}; }

Json model_schema(bool is_complete) {
  const Params paper = *preset(kPresetDefault);
  Json model = {{"type", "object"}, {"properties", Json::object()}, {"additionalProperties", false}};
  const auto require = [&](Json& object, const std::string& name) {
    if (is_complete) object["required"].push_back(name);
  };
  for (const ParamInfo& info : param_table()) {
    const std::size_t dot = info.path.find('.');
    const std::string leaf(dot == std::string_view::npos ? info.path : info.path.substr(dot + 1));
    Json* parent = &model;
    if (dot != std::string_view::npos) {
      const std::string group(info.path.substr(0, dot));
      if (!model["properties"].contains(group)) {
        model["properties"][group] = {
            {"type", "object"}, {"properties", Json::object()}, {"additionalProperties", false}};
        require(model, group);
      }
      parent = &model["properties"][group];
    }
    Json schema = std::visit(ParamSchema{info}, info.access);
    schema["description"] = std::string(info.text) + (info.unit.empty() ? "" : " (" + std::string(info.unit) + ")");
    if (info.path.ends_with("positions_um")) {
      // No default: without positions count and radius_um hold.
      schema["description"] = schema["description"].get<std::string>() +
                              "; the limit of a request's body (1 MiB unless configured otherwise) holds about 60,000";
    } else {
      schema["default"] = encode_param(info, paper);
    }
    (*parent)["properties"][leaf] = std::move(schema);
    if (!info.path.starts_with("founders.")) require(*parent, leaf);
  }
  Json& founders = model["properties"]["founders"];
  const Json by_count = Json::array({"count", "radius_um"});
  const Json by_position = Json::array({"positions_um"});
  if (is_complete) {
    founders["oneOf"] = Json::array({{{"required", by_count}}, {{"required", by_position}}});
  } else {
    founders["not"] = {
        {"required", by_position},
        {"anyOf", Json::array({{{"required", Json::array({"count"})}}, {{"required", Json::array({"radius_um"})}}})}};
  }
  return model;
}

Json job_spec_schema(const SpecLimits& limits) {
  return {{"$schema", "https://json-schema.org/draft/2020-12/schema"},
          {"$id", "urn:colony:schema:job"},
          {"title", "Job spec"},
          {"description", "model is a partial override of the preset; defaults shown are those of the preset paper"},
          {"type", "object"},
          {"properties",
           {{"name", name_schema()},
            {"labels", labels_schema()},
            {"seed", seed_schema()},
            {"preset", preset_schema()},
            {"until", until_schema(limits)},
            {"model", model_schema(false)}}},
          {"required", Json::array({"until"})},
          {"additionalProperties", false}};
}

Json fork_spec_schema(const SpecLimits& limits) {
  return {{"title", "Fork"},
          {"description", "model is a partial override of the origin's complete model; what shaped the cells that are there cannot change"},
          {"type", "object"},
          {"properties",
           {{"at_h", {{"type", "number"}, {"minimum", 0}, {"maximum", kUntilTimeMax_h}}},
            {"at_seq", {{"type", "integer"}, {"minimum", 1}}},
            {"name", name_schema()},
            {"labels", labels_schema()},
            {"seed", {{"type", "integer"}, {"minimum", 0}, {"maximum", kSeedMax}, {"description", "default: the origin's"}}},
            {"until", until_schema(limits)},
            {"model", model_schema(false)}}},
          {"required", Json::array({"until"})},
          {"oneOf", Json::array({{{"required", Json::array({"at_h"})}}, {{"required", Json::array({"at_seq"})}}})},
          {"additionalProperties", false}};
}

}  // namespace colony::server::api
