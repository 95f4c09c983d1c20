// spec_fuzz: a request body as a job spec: bytes, strict JSON, spec, normal form.
// Promise checked: JSON that is read was read to its end, and has one reading (its text reads as itself); an error names places; an
//                  accepted spec is written in a normal form that is accepted, as submitted and as stored, and is its own normal form.
#include <cstdlib>
#include <string>
#include <string_view>

#include "server/api/codec_spec.hpp"

namespace {

using namespace colony;
using namespace colony::server::api;

void require(bool holds) {
  if (!holds) std::abort();
}

void check_error(const Error& error) {
  require(!error.message.empty());
  for (const FieldError& field : error.fields) {
    require(!field.message.empty() && (field.pointer.empty() || field.pointer.front() == '/'));
    // As problem documents carry them, whatever the bytes were.
    require(bool(parse_json(to_text(Json{field.message, field.pointer}))));
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  const auto json = parse_json(text);
  if (!json) {
    check_error(json.error());
    return 0;
  }
  require(!parse_json(std::string(text) + " x"));  // all of it was read
  const std::string written = to_text(*json);
  const auto again = parse_json(written);
  require(again && to_text(*again) == written);

  const SpecLimits limits{1'000'000};
  const auto spec = decode_spec(*json, limits);
  if (!spec) {
    require(!spec.error().fields.empty());
    check_error(spec.error());
    return 0;
  }
  const std::string normal = to_text(encode_spec(*spec));
  const auto reread = decode_spec(*parse_json(normal), limits);
  require(bool(reread));
  require(to_text(encode_spec(*reread)) == normal);
  require(bool(decode_stored_spec(normal)));
  require(new_job(*spec).spec_json == normal && new_job(*spec).name == spec->name);
  return 0;
}
