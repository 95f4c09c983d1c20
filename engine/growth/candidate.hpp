// candidate: from a chromosome to the two bodies a search scores, fast. decode() in chromosome.hpp is the definition, in double
// precision; this is its twin in single precision, with every function of one gene looked up by the gene's code.
// Units:   um relative to the search's origin (the pivot), rad.
// Accuracy: within 1e-4 um of decode() (tests/unit/candidate_test.cpp). The winner of a search is decoded by decode().
// Threads: pure.
#pragma once

#include <array>
#include <vector>

#include "engine/growth/chromosome.hpp"
#include "engine/space/pair_kernel.hpp"

namespace colony {

/// Values of one gene by its code (Gray decoded).
class GeneTables {
 public:
  explicit GeneTables(const Params& params);

  /// `phases`: the pair's bodies with their noise; m and t are overwritten.
  void decode(const Chromosome& chromosome, const PairFrame& frame, std::array<kernel::CandidateBody, 2>& pair) const;

 private:
  struct Two {
    float first = 0.0F, second = 0.0F;
  };
  struct Flatness {
    float mean = 0.0F, flatness = 0.0F, inverse = 0.0F;
  };
  using Column = std::vector<float>;
  using Columns = std::vector<Two>;

  Layers layers_;
  float noisy_scale_;
  Columns turn_;            // cos, sin
  Column pair_volume_;      // cbrt(3 V / (4 pi))
  Columns smaller_share_;   // cbrt(1 - share), cbrt(share)
  Columns elongation_;      // sqrt(e), 1 / sqrt(e)
  std::vector<Flatness> flatness_;   // f^(-1/3), f, 1 / f
  Columns rotation_;        // cos, sin
  Columns tilt_;            // cos, sin
  Column distance_;
  Column sideways_;
  Column height_;           // of the centre, in C
};

}  // namespace colony
