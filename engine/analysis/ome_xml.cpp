#include "engine/analysis/ome_xml.hpp"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstring>
#include <expat.h>
#include <memory>
#include <type_traits>

#include "engine/analysis/image.hpp"

namespace colony {
namespace {

struct Reading {
  std::vector<double> sizes_um;  // x and y of every Pixels that states any
  std::string wrong;             // the first thing that cannot be used
  bool has_document_type = false;
};

double um_of_unit(std::string_view unit) {
  struct Unit {
    std::string_view name;
    double um;
  };
  // The micro sign and the Greek letter are two characters that look alike; files have both.
  constexpr Unit kUnits[] = {{"\xc2\xb5m", 1.0}, {"\xce\xbcm", 1.0}, {"um", 1.0}, {"nm", 1e-3},
                             {"pm", 1e-6},       {"mm", 1e3},        {"cm", 1e4}, {"m", 1e6}};
  for (const Unit& known : kUnits) {
    if (known.name == unit) return known.um;
  }
  return 0.0;
}

/// Names of elements may have a prefix.
bool is_named(const char* name, const char* wanted) {
  const char* colon = std::strrchr(name, ':');
  return std::strcmp(colon == nullptr ? name : colon + 1, wanted) == 0;
}

void read_side(const char* const* attributes, const char* size_name, const char* unit_name, Reading& reading) {
  std::string_view size, unit = "\xc2\xb5m";
  for (; attributes[0] != nullptr; attributes += 2) {
    if (std::strcmp(attributes[0], size_name) == 0) size = attributes[1];
    if (std::strcmp(attributes[0], unit_name) == 0) unit = attributes[1];
  }
  if (size.empty()) return;
  double value = 0.0;
  const auto [end, status] = std::from_chars(size.data(), size.data() + size.size(), value);
  const double um = value * um_of_unit(unit);
  if (status == std::errc() && end == size.data() + size.size() && um >= kImageScaleMin_um_per_px && um <= kImageScaleMax_um_per_px) {
    reading.sizes_um.push_back(um);
  } else if (reading.wrong.empty()) {
    reading.wrong = std::string(size_name) + " \"" + std::string(size.substr(0, 40)) + "\" " + std::string(unit.substr(0, 20)) +
                    " is no size of a pixel";
  }
}

void XMLCALL on_element(void* user, const XML_Char* name, const XML_Char** attributes) {
  if (!is_named(name, "Pixels")) return;
  Reading& reading = *static_cast<Reading*>(user);
  const std::size_t before = reading.sizes_um.size();
  read_side(attributes, "PhysicalSizeX", "PhysicalSizeXUnit", reading);
  read_side(attributes, "PhysicalSizeY", "PhysicalSizeYUnit", reading);
  if (reading.sizes_um.size() == before + 1 && reading.wrong.empty()) reading.wrong = "only one side of a pixel is stated";
}

struct FreeParser {
  void operator()(XML_Parser parser) const { XML_ParserFree(parser); }
};

void XMLCALL on_document_type(void* user, const XML_Char*, const XML_Char*, const XML_Char*, int) {
  static_cast<Reading*>(user)->has_document_type = true;
}

}  // namespace

bool scales_differ(double a_um, double b_um) { return std::abs(a_um - b_um) > kScaleTolerance * std::max(a_um, b_um); }

std::string scale_text(double um) {
  char text[32];
  const auto [end, status] = std::to_chars(text, text + sizeof text, um, std::chars_format::general, 6);
  return {text, end};
}

bool is_ome_xml(std::string_view text) {
  return text.substr(0, 4096).find("<OME") != text.npos || text.substr(0, 4096).find(":OME ") != text.npos;
}

OmeScale read_ome_scale(std::string_view text) {
  if (text.size() > kOmeTextMax_bytes) return {{}, {"the OME metadata was not read: it is longer than 1 MiB"}};
  const std::unique_ptr<std::remove_pointer_t<XML_Parser>, FreeParser> parser(XML_ParserCreate(nullptr));
  if (parser == nullptr) return {{}, {"the OME metadata was not read: not enough memory"}};
  Reading reading;
  XML_SetUserData(parser.get(), &reading);
  XML_SetStartElementHandler(parser.get(), on_element);
  XML_SetStartDoctypeDeclHandler(parser.get(), on_document_type);
  const bool is_whole = XML_Parse(parser.get(), text.data(), static_cast<int>(text.size()), 1) == XML_STATUS_OK;
  if (!is_whole || reading.has_document_type) {
    return {{}, {"the OME metadata was not used: " + std::string(is_whole ? "it has a document type" : "it is no well-formed XML")}};
  }
  if (!reading.wrong.empty()) return {{}, {"the OME metadata's scale was not used: " + reading.wrong}};
  for (const double size_um : reading.sizes_um) {
    if (scales_differ(size_um, reading.sizes_um.front())) {
      return {{}, {"the OME metadata's scale was not used: it states " + scale_text(reading.sizes_um.front()) + " and " +
                   scale_text(size_um) + " um for sides or images of one file"}};
    }
  }
  if (reading.sizes_um.empty()) return {{}, {}};
  return {reading.sizes_um.front(), {}};
}

}  // namespace colony
