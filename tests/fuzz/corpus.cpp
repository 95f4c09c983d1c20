// corpus: writes the fuzzers' first inputs, files of every kind that is read, into FOLDER/png, FOLDER/tiff and FOLDER/jpeg.
// Why not committed: they are made from tests/support/image_files.hpp, so they cannot fall behind it.
// Usage: corpus FOLDER
#include <filesystem>
#include <fstream>
#include <iostream>

#include "tests/support/image_files.hpp"

namespace {

using namespace colony::testing;

void write(const std::filesystem::path& folder, const std::string& bytes) {
  static int number = 0;
  std::filesystem::create_directories(folder);
  std::ofstream(folder / std::to_string(number++), std::ios::binary) << bytes;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::cerr << "usage: corpus FOLDER\n";
    return 2;
  }
  const std::filesystem::path top = argv[1];
  for (const int bits : {1, 2, 4, 8, 16}) {
    for (const int type : {0, 2, 3, 4, 6}) {
      const int channels[] = {1, 0, 3, 1, 2, 0, 4};
      PngSpec spec{static_cast<std::uint8_t>(type), static_cast<std::uint8_t>(bits),
                   static_cast<std::uint8_t>(bits == 8 ? 1 : 0)};
      if (type == 3) spec.palette = std::vector<spng_plte_entry>(2, spng_plte_entry{10, 20, 30, 255});
      const std::vector<std::uint8_t> rows(static_cast<std::size_t>((9 * channels[type] * bits + 7) / 8 * 5), 0);
      if (const std::string file = png_file(9, 5, spec, rows); !file.empty()) write(top / "png", file);
    }
  }
  for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE, COMPRESSION_PACKBITS}) {
    for (const int bits : {8, 16}) {
      for (const int tile : {0, 16}) {
        for (const int channels : {1, 3}) {
          TiffSpec spec{.bits = bits, .compression = static_cast<std::uint16_t>(compression), .tile = tile};
          spec.planar = bits == 16;
          spec.predictor = compression == COMPRESSION_LZW;
          spec.photometric = channels == 3 ? PHOTOMETRIC_RGB : PHOTOMETRIC_MINISBLACK;
          write(top / "tiff", tiff_file({gradient(9, 5, channels, 200), gradient(9, 5, channels, 200)}, spec));
        }
      }
    }
  }
  write(top / "tiff", tiff_file({gradient(9, 5, 1, 255)}, {.photometric = PHOTOMETRIC_PALETTE}));
  write(top / "tiff",
        tiff_file(
            {gradient(9, 5, 4, 255)},
            {.photometric = PHOTOMETRIC_RGB, .big_endian = true, .big_tiff = true, .alpha = EXTRASAMPLE_ASSOCALPHA}));
  for (const int channels : {1, 3}) {
    for (const bool progressive : {false, true})
      write(top / "jpeg", jpeg_file(gradient(17, 9, channels, 255), 60, progressive));
  }
  return 0;
}
