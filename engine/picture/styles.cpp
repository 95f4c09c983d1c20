#include "engine/picture/styles.hpp"

#include <algorithm>
#include <cmath>

#include "engine/picture/optics.hpp"

namespace colony {
namespace {

// Towards the light: x to the right, y up, z to the viewer; (-1, 1, 1.6) over its length.
constexpr double kLightX = -0.46829, kLightY = 0.46829, kLightZ = 0.74927;
constexpr double kAmbient = 0.28;
constexpr double kDiffuse = 0.92;

/// Owner at (row, column); outside the view there is no cell.
std::uint32_t owner_at(const TopView& view, std::int64_t row, std::int64_t column) {
  if (!view.has_row(row) || column < 0 || column >= view.frame.width_px) return 0;
  return view.owner[view.index(row, column)];
}

/// Rise of the height per um from one side to the other of a pixel, over those of the two neighbours that are the same
/// cell: a step to another cell is a border, not a slope.
double rise(const TopView& view, std::int64_t row, std::int64_t column, std::int64_t down, std::int64_t right) {
  const std::uint32_t owner = owner_at(view, row, column);
  const auto height = [&](std::int64_t r, std::int64_t c) {
    return static_cast<double>(view.height_um[view.index(r, c)]);
  };
  const bool before = owner_at(view, row - down, column - right) == owner;
  const bool after = owner_at(view, row + down, column + right) == owner;
  if (!before && !after) return 0.0;
  const double low = before ? height(row - down, column - right) : height(row, column);
  const double high = after ? height(row + down, column + right) : height(row, column);
  return (high - low) / (view.frame.um_per_px * (before && after ? 2.0 : 1.0));
}

double brightness(const TopView& view, std::int64_t row, std::int64_t column) {
  const double slope_x = rise(view, row, column, 0, 1);
  const double slope_y = -rise(view, row, column, 1, 0);  // rows run down, y up
  const double along = kLightZ - slope_x * kLightX - slope_y * kLightY;
  const double diffuse = std::max(0.0, along / std::sqrt(1.0 + slope_x * slope_x + slope_y * slope_y));
  return kAmbient + kDiffuse * diffuse;
}

/// How much of each pixel of a cell lies under the border line, 0..1: from the distance of the pixel's centre to the
/// nearest pixel of its own cell that has a foreign 4-neighbour.
std::vector<float> border_shares(const TopView& view) {
  const std::int64_t width = view.frame.width_px;
  const double half_width_px =
      std::min(kBorderHalfWidth_um / view.frame.um_per_px, static_cast<double>(kBorderHalfWidthMax_px));
  const std::int64_t reach = ceil_to_int(half_width_px);
  std::vector<float> shares(view.owner.size(), 0.0f);
  for (std::int64_t row = view.rows.first; row < view.rows.end; ++row) {
    for (std::int64_t column = 0; column < width; ++column) {
      const std::uint32_t owner = view.owner[view.index(row, column)];
      if (owner == 0) continue;
      // Rows outside the strip count as the same cell: they are another strip's business, and the halo keeps them out
      // of reach.
      const bool inner = (!view.has_row(row - 1) || owner_at(view, row - 1, column) == owner) &&
                         (!view.has_row(row + 1) || owner_at(view, row + 1, column) == owner) &&
                         owner_at(view, row, column - 1) == owner && owner_at(view, row, column + 1) == owner;
      if (inner) continue;
      for (std::int64_t dy = -reach; dy <= reach; ++dy) {
        for (std::int64_t dx = -reach; dx <= reach; ++dx) {
          if (owner_at(view, row + dy, column + dx) != owner) continue;
          // The edge runs half a pixel outside the centre of the border pixel; the line covers half_width_px inside it.
          const double distance = std::sqrt(static_cast<double>(dx * dx + dy * dy)) + 0.5;
          const auto share = static_cast<float>(std::clamp(half_width_px + 0.5 - distance, 0.0, 1.0));
          float& stored = shares[view.index(row + dy, column + dx)];
          stored = std::max(stored, share);
        }
      }
    }
  }
  return shares;
}

}  // namespace

void paint_shaded(const TopView& view, RowRange rows, const std::vector<Rgb>& colour_of_cell, Picture& picture) {
  const std::vector<float> border = border_shares(view);
  for (std::int64_t row = rows.first; row < rows.end; ++row) {
    for (std::int64_t column = 0; column < view.frame.width_px; ++column) {
      const std::size_t at = view.index(row, column);
      const std::uint32_t owner = view.owner[at];
      if (owner == 0) {
        put_pixel(picture, row, column, kDarkBackground);
        continue;
      }
      const double nucleus = kNucleusOpacity * static_cast<double>(view.nucleus[at]) / 255.0;
      const Rgb inside = blend(colour_of_cell[owner - 1], kNucleusColour, nucleus);
      const Rgb surface = lit(inside, brightness(view, row, column));
      put_pixel(picture, row, column, blend(surface, kBorderColour, static_cast<double>(border[at])));
    }
  }
}

void paint_contours(const TopView& view, RowRange rows, ContourLines lines, Picture& picture) {
  for (std::int64_t row = rows.first; row < rows.end; ++row) {
    for (std::int64_t column = 0; column < view.frame.width_px; ++column) {
      const std::uint32_t owner = owner_at(view, row, column);
      const auto borders = [&](std::uint32_t other) {
        if (lines == ContourLines::kColony) return owner != 0 && other == 0;
        return other < owner && (lines == ContourLines::kBoth || other != 0);
      };
      const bool line = borders(owner_at(view, row - 1, column)) || borders(owner_at(view, row + 1, column)) ||
                        borders(owner_at(view, row, column - 1)) || borders(owner_at(view, row, column + 1));
      put_pixel(picture, row, column, line ? kBlack : kWhite);
    }
  }
}

void paint_labels(const TopView& view, RowRange rows, Picture& picture) {
  for (std::int64_t row = rows.first; row < rows.end; ++row) {
    for (std::int64_t column = 0; column < view.frame.width_px; ++column) {
      const std::uint32_t colour = label_colour(CellId{owner_at(view, row, column)});
      put_pixel(picture, row, column,
                {static_cast<std::uint8_t>(colour >> 16), static_cast<std::uint8_t>((colour >> 8) & 255),
                 static_cast<std::uint8_t>(colour & 255)});
    }
  }
}

void paint_brightfield(const PathView& view, RowRange rows, Picture& picture) {
  for (std::int64_t row = rows.first; row < rows.end; ++row) {
    for (std::int64_t column = 0; column < view.frame.width_px; ++column) {
      const std::size_t at = view.index(row, column);
      if (!(view.cell_um[at] > 0.0F)) {
        put_pixel(picture, row, column, kWhite);
        continue;
      }
      const auto channel = [&](int colour) {
        const double share =
            transmission(colour, static_cast<double>(view.cell_um[at]), static_cast<double>(view.nucleus_um[at]));
        return static_cast<std::uint8_t>(255.0 * share + 0.5);
      };
      put_pixel(picture, row, column, {channel(0), channel(1), channel(2)});
    }
  }
}

void paint_phase(const PathView& view, const std::vector<float>& intensity, RowRange rows, Picture& picture) {
  for (std::int64_t row = rows.first; row < rows.end; ++row) {
    for (std::int64_t column = 0; column < view.frame.width_px; ++column) {
      const auto grey = static_cast<std::uint8_t>(255.0F * intensity[view.index(row, column)] + 0.5F);
      put_pixel(picture, row, column, {grey, grey, grey});
    }
  }
}

}  // namespace colony
