// optics: what a microscope makes of the path lengths: absorption (brightfield) and delay (phase contrast).
// Brightfield: Beer-Lambert, I = exp(-(mu_c L_c + mu_n L_n)) for each colour, L_c the path in cytoplasm, L_n in nuclei;
//          cells that lie over each other absorb together. The coefficients are those of a faint stain, chosen so that
//          cells stay clear and nuclei show: living cells absorb nearly nothing.
// Phase:   phi = 2 pi / lambda (dn_c L_c + dn_n L_n) against the medium; I = kPhaseGrey + kPhaseGain (K * phi - phi),
//          held to [0, 1]: dark cells in a bright halo, as positive phase contrast shows them, where the phase ring also
//          takes away what is coarser than the kernel K. K is a Gaussian of kHaloSigma_um, cut at 3 sigma. A colony's
//          interior is grey and shows its details only (shade-off), as it should.
// Method:  K * phi on a coarser raster of whole pixels (sigma / 6 or less; samples at its pixels' centres), then
//          bilinear. It is anchored to the frame and found again for each strip: memory is a strip's, and strips cannot
//          matter.
// Units:   um, rad; intensities are shares of the light without cells (brightfield) or of white (phase).
// Errors:  as path_lengths.
// Threads: rows side by side; sums run in index order.
#pragma once

#include <array>
#include <vector>

#include "engine/picture/paths.hpp"

namespace colony {

/// Absorption per um, red, green, blue.
inline constexpr std::array<double, 3> kCytoplasmAbsorption_per_um = {0.022, 0.058, 0.030};
inline constexpr std::array<double, 3> kNucleusAbsorption_per_um = {0.260, 0.300, 0.140};
/// The colour that stands for brightfield where there is one channel.
inline constexpr int kGreen = 1;

inline constexpr double kCytoplasmIndexExcess = 0.030;  // refractive index over the medium's 1.335
inline constexpr double kNucleusIndexExcess = 0.045;
inline constexpr double kWavelength_um = 0.55;
inline constexpr double kHaloSigma_um = 4.0;
inline constexpr double kPhaseGrey = 0.5;
inline constexpr double kPhaseGain_per_rad = 0.30;

/// Share of the light of one colour (0..2) that comes through.
double transmission(int colour, double cell_um, double nucleus_um);

/// Delay against the medium, rad.
double phase_rad(double cell_um, double nucleus_um);

/// Phase-contrast intensity in [0, 1] of every pixel of `view`, in its order.
std::vector<float> phase_contrast(const Colony& colony, ContactRule rule, const PathView& view,
                                  const Effort& effort = {});

}  // namespace colony
