#include "server/api/docs.hpp"

#include <algorithm>
#include <vector>

namespace colony::server::api {
namespace {

constexpr int kDepthMax = 12;  // of a schema inside others; deeper parts are named only

std::string escaped(std::string_view text) { return docs_escaped(text); }

/// A text for people: escaped, and what stands in backticks as code.
std::string prose(std::string_view text) {
  std::string out;
  bool is_code = false;
  for (const char c : escaped(text)) {
    if (c != '`') {
      out += c;
    } else {
      out += is_code ? "</code>" : "<code>";
      is_code = !is_code;
    }
  }
  return is_code ? escaped(text) : out;  // an odd one out is no markup
}

std::string text_of(const Json& node, const char* name) {
  const auto found = node.find(name);
  return found != node.end() && found->is_string() ? found->get<std::string>() : std::string();
}

/// A member, or an empty object: never a temporary, so that it can be walked through.
const Json& member(const Json& node, const char* name) {
  static const Json kNothing = Json::object();
  const auto found = node.find(name);
  return found != node.end() ? *found : kNothing;
}

std::string upper(std::string text) {
  for (char& c : text) c = c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  return text;
}

std::string code(std::string_view text) { return "<code>" + escaped(text) + "</code>"; }

class Page {
 public:
  Page(const Json& openapi, std::string_view base_path, bool tokens_required)
      : openapi_(openapi), base_path_(base_path), tokens_required_(tokens_required) {}

  std::string text() {
    const Json& info = openapi_["info"];
    const std::string title = text_of(info, "title") + " " + text_of(info, "version");
    out_ = "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
           "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n<title>" + escaped(title) +
           "</title>\n<link rel=\"stylesheet\" href=\"" + escaped(base_path_) + "/docs.css\">\n</head>\n<body>\n<header>\n<h1>" +
           escaped(title) + "</h1>\n<p>" + escaped(text_of(info, "summary")) + ". " + escaped(text_of(info, "description")) +
           "</p>\n<p>The same for programs: <a href=\"" + escaped(base_path_) + "/openapi.json\">openapi.json</a>, <a href=\"" +
           escaped(base_path_) + "/v1/schema/job\">the schema of a job</a>, <a href=\"" + escaped(base_path_) +
           "/v1/service-info\">limits and presets</a>.</p>\n</header>\n";
    contents();
    out_ += "<main>\n" + docs_guide(tokens_required_);
    for (const Json& tag : openapi_["tags"]) group(tag);
    schemas();
    out_ += "</main>\n</body>\n</html>\n";
    return std::move(out_);
  }

 private:
  template <class Use>
  void each_operation(const std::string& tag, Use use) {
    for (const auto& [path, item] : openapi_["paths"].items()) {
      for (const auto& [method, operation] : item.items()) {
        if (operation["tags"][0] == tag) use(path, upper(method), operation);
      }
    }
  }

  void contents() {
    out_ += "<nav aria-label=\"Contents\">\n<h2><a href=\"#before\">Before the examples</a></h2>\n<h2><a href=\"#reading-streams\">Reading a "
            "stream</a></h2>\n";
    for (const Json& tag : openapi_["tags"]) {
      const std::string name = text_of(tag, "name");
      out_ += "<h2><a href=\"#" + escaped(name) + "\">" + escaped(name) + "</a></h2>\n<ul>\n";
      each_operation(name, [&](const std::string& path, const std::string& method, const Json& operation) {
        out_ += "<li><a href=\"#" + escaped(text_of(operation, "operationId")) + "\"><b>" + method + "</b> " + escaped(path) +
                "</a></li>\n";
      });
      out_ += "</ul>\n";
    }
    out_ += "<h2><a href=\"#schemas\">Schemas</a></h2>\n</nav>\n";
  }

  void group(const Json& tag) {
    const std::string name = text_of(tag, "name");
    out_ += "<section>\n<h2 id=\"" + escaped(name) + "\">" + escaped(name) + "</h2>\n<p>" +
            escaped(text_of(tag, "description")) + "</p>\n";
    each_operation(name, [&](const std::string& path, const std::string& method, const Json& operation) {
      this->operation(path, method, operation);
    });
    out_ += "</section>\n";
  }

  void operation(const std::string& path, const std::string& method, const Json& operation) {
    out_ += "<article id=\"" + escaped(text_of(operation, "operationId")) + "\">\n<h3><b>" + method + "</b> " + escaped(path) +
            "</h3>\n<p>" + prose(text_of(operation, "summary")) + "</p>\n";
    if (const std::string more = text_of(operation, "description"); !more.empty()) out_ += "<p>" + prose(more) + "</p>\n";
    parameters(operation["parameters"]);
    if (const auto body = operation.find("requestBody"); body != operation.end()) {
      out_ += "<h4>Body</h4>\n<ul>\n";
      for (const auto& [media, content] : (*body)["content"].items()) {
        out_ += "<li>" + code(media) + " " + type_text(member(content, "schema")) + "</li>\n";
      }
      out_ += "</ul>\n";
    }
    answers(operation["responses"]);
    out_ += "<h4>Example</h4>\n<pre><code>" + escaped(example(path, method, operation)) + "</code></pre>\n</article>\n";
  }

  const Json& resolved(const Json& node) const {
    const std::string target = text_of(node, "$ref");
    return target.empty() ? node : openapi_.at(Json::json_pointer(target.substr(1)));
  }

  void parameters(const Json& list) {
    if (list.empty()) return;
    out_ += "<h4>Parameters</h4>\n<table>\n<thead><tr><th>Name</th><th>In</th><th>Type</th><th></th></tr></thead>\n<tbody>\n";
    for (const Json& one : list) {
      const Json& parameter = resolved(one);
      out_ += "<tr><td>" + code(text_of(parameter, "name")) + "</td><td>" + escaped(text_of(parameter, "in")) + "</td><td>" +
              type_text(parameter["schema"]) + "</td><td>" + prose(text_of(parameter, "description")) + "</td></tr>\n";
    }
    out_ += "</tbody>\n</table>\n";
  }

  // What this operation says itself; what any request can get is the same everywhere and told once, folded.
  void answers(const Json& responses) {
    std::string usual;
    out_ += "<h4>Answers</h4>\n<table>\n<thead><tr><th>Status</th><th></th><th>Content</th><th>Fields</th></tr></thead>\n<tbody>\n";
    for (const auto& [status, answer] : responses.items()) {
      const bool is_problem = status.size() == 3 && status[0] >= '4';
      const std::string text = text_of(answer, "description");
      if (is_problem || status == "default") {
        usual += "<tr><td>" + escaped(status) + "</td><td>" + escaped(text) + "</td></tr>\n";
        continue;
      }
      std::string content, fields;
      for (const auto& [media, value] : member(answer, "content").items()) {
        content += code(media) + " " + type_text(member(value, "schema")) + "<br>";
      }
      for (const auto& [name, value] : member(answer, "headers").items()) {
        if (name != "X-Request-Id") fields += "<b>" + escaped(name) + "</b>: " + prose(text_of(value, "description")) + "<br>";
      }
      out_ += "<tr><td>" + escaped(status) + "</td><td>" + prose(text) + "</td><td>" + content + "</td><td>" + fields + "</td></tr>\n";
    }
    out_ += "</tbody>\n</table>\n<details><summary>Problems</summary>\n<p>Each is a <a href=\"#schema-Problem\">Problem</a>.</p>\n<table>\n<tbody>\n" +
            usual + "</tbody>\n</table>\n</details>\n";
  }

  std::string example(const std::string& path, const std::string& method, const Json& operation) const {
    std::string url = "$BASE";  // docs_guide
    for (const char c : path) {
      if (c != '{' && c != '}') url += c;
    }
    std::string line = "curl";
    if (method != "GET") line += " -X " + method;
    const bool needs_token = tokens_required_ && !member(operation, "security").empty();
    if (needs_token) line += " -H \"Authorization: Bearer $TOKEN\"";
    if (const auto body = operation.find("requestBody"); body != operation.end()) {
      const auto first = member(*body, "content").begin();
      const std::string& media = first.key();
      const Json& content = *first;
      line += " -H 'Content-Type: " + media + "'";
      if (media.find("json") == std::string::npos) {
        line += " --data-binary @picture";
      } else if (const Json body_example = example_of(member(content, "schema")); !body_example.is_null()) {
        line += " -d '" + to_text(body_example) + "'";
      }
    }
    // Where an answer has several forms, the form is named.
    const Json& responses = operation["responses"];
    if (const auto answer = responses.find("200"); answer != responses.end() && answer->contains("content")) {
      const Json& forms = (*answer)["content"];
      if (forms.contains("text/event-stream")) line += " -N";
      const std::string& form = forms.begin().key();
      if (forms.size() > 1) line += " -H 'Accept: " + form + "'";
      const bool is_file = form.find("image/") == 0 || form.find("model/") == 0;
      if (is_file) line += " -o FILE";
    }
    return line + " \"" + url + "\"";
  }

  Json example_of(const Json& schema) const {
    const Json& full = resolved(schema);
    const auto found = full.find("examples");
    return found != full.end() && found->is_array() && !found->empty() ? found->front() : Json();
  }

  // A type in a few words; components as links.
  std::string type_text(const Json& schema) const {
    if (const std::string target = text_of(schema, "$ref"); !target.empty()) {
      const std::string name = target.substr(target.rfind('/') + 1);
      return "<a href=\"#schema-" + escaped(name) + "\">" + escaped(name) + "</a>";
    }
    if (const auto value = schema.find("const"); value != schema.end()) return code(to_text(*value));
    if (const auto names = schema.find("enum"); names != schema.end()) {
      std::string out;
      for (const Json& name : *names) out += (out.empty() ? "" : " ") + code(name.is_string() ? name.get<std::string>() : to_text(name));
      return out;
    }
    for (const char* choice : {"oneOf", "anyOf"}) {
      if (!schema.contains(choice)) continue;
      std::string out;
      for (const Json& one : schema[choice]) out += (out.empty() ? "" : " or ") + type_text(one);
      return out;
    }
    if (text_of(schema, "type") == "array" && schema.contains("items")) return "list of " + type_text(schema["items"]);
    return plain_type(schema) + range_text(schema);
  }

  static std::string plain_type(const Json& schema) {
    const auto type = schema.find("type");
    if (type == schema.end()) return "any";
    if (type->is_string()) return escaped(type->get<std::string>());
    std::string out;
    for (const Json& one : *type) out += (out.empty() ? "" : " or ") + escaped(one.get<std::string>());
    return out;
  }

  static std::string range_text(const Json& schema) {
    const auto bound = [&](const char* name) {
      const auto found = schema.find(name);
      return found == schema.end() ? std::string() : to_text(*found);
    };
    const std::string low = bound("minimum"), high = bound("maximum"), above = bound("exclusiveMinimum");
    if (!low.empty() && !high.empty()) return ", " + low + " to " + high;
    if (!low.empty()) return ", " + low + " or more";
    if (!above.empty()) return ", above " + above + (high.empty() ? "" : ", at most " + high);
    return high.empty() ? "" : ", at most " + high;
  }

  void schemas() {
    out_ += "<section>\n<h2 id=\"schemas\">Schemas</h2>\n";
    for (const auto& [name, schema] : openapi_["components"]["schemas"].items()) {
      out_ += "<article id=\"schema-" + escaped(name) + "\">\n<h3>" + escaped(name) + "</h3>\n";
      members(schema, 0);
      out_ += "</article>\n";
    }
    out_ += "</section>\n";
  }

  void members(const Json& schema, int depth) {
    if (const std::string text = text_of(schema, "description"); !text.empty() && depth == 0) out_ += "<p>" + prose(text) + "</p>\n";
    for (const char* choice : {"oneOf", "anyOf"}) {
      if (!schema.contains(choice)) continue;
      out_ += "<p>One of:</p>\n";
      for (const Json& one : schema[choice]) members(one, depth + 1);
      return;
    }
    const auto properties = schema.find("properties");
    if (properties == schema.end() || properties->empty()) {
      out_ += "<p>" + type_text(schema) + "</p>\n";
      return;
    }
    const Json& required = member(schema, "required");
    out_ += "<table>\n<tbody>\n";
    for (const auto& [name, value] : properties->items()) {
      const bool is_required = std::find(required.begin(), required.end(), Json(name)) != required.end();
      out_ += "<tr><td>" + code(name) + (is_required ? "" : "<br><small>optional</small>") + "</td><td>";
      const bool has_members = value.contains("properties") && !value["properties"].empty();
      if (has_members && depth < kDepthMax) {
        out_ += "<details><summary>object</summary>\n";
        members(value, depth + 1);
        out_ += "</details>";
      } else {
        out_ += type_text(value);
      }
      out_ += "</td><td>" + prose(text_of(value, "description")) + "</td></tr>\n";
    }
    out_ += "</tbody>\n</table>\n";
  }

  const Json& openapi_;
  const std::string base_path_;
  const bool tokens_required_;
  std::string out_;
};

}  // namespace

std::string docs_escaped(std::string_view text) {
  std::string out;
  for (const char c : text) {
    switch (c) {
      case '&': out += "&amp;"; break;
      case '<': out += "&lt;"; break;
      case '>': out += "&gt;"; break;
      case '"': out += "&quot;"; break;
      case '\'': out += "&#39;"; break;
      default: out += c;
    }
  }
  return out;
}

std::string docs_page(const Json& openapi, std::string_view base_path, bool tokens_required) {
  return Page(openapi, base_path, tokens_required).text();
}

}  // namespace colony::server::api
