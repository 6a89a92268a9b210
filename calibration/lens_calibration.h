#pragma once

// One sitting with a board in front of a camera: which pictures count, the lens, how sure it is, and a verdict in plain
// words.

#include <functional>
#include <string>
#include <vector>

#include "calibration/lens_agreement.h"
#include "calibration/lens_fit.h"
#include "calibration/report.h"
#include "calibration/target.h"
#include "scene/core/program.h"
#include "scene/core/result.h"

namespace daylit::calibration {

/// A form of the fish-eye's curve, and what views that were left out in turn are off by with it.
struct TriedCurve {
  std::string name; ///< polynomial (four coefficients), equidistant or equisolid (none)
  double held_out_rms_px = 0;
};

struct LensCalibration {
  LensKind kind = LensKind::pinhole;
  LensFit fit;                  ///< of the pictures that count
  std::vector<BoardView> views; ///< the same pictures, as fit.pose
  std::vector<DroppedPicture> dropped;
  ImageCircle circle;             ///< of a fish-eye; radius 0: none found
  std::vector<TriedCurve> curves; ///< of a fish-eye; the first one is the lens
  double held_out_rms_px = 0;     ///< over views, each by a lens fitted to the others; NaN: none could be
  double reach_deg = 0;           ///< largest angle of a corner from the axis
  double coverage = 0;            ///< of 8 x 8 parts of the picture (of the circle): those with a corner
  double tilt_spread_deg = 0;     ///< largest angle between two boards
  LensAgreement agreement;        ///< of the views on one lens
  bool pass = false;
  std::vector<std::string> why; ///< the reasons for the verdict, and what to do
};

struct BoardPicture {
  std::string file;
  Rgb8Image picture;
};

/// Pictures are asked for one after another: `read(i)` of `count`. A picture that cannot be used is named in `dropped`.
/// Fewer than three pictures can be used:
/// no views, and `why` says so. Errors: interrupted; usage, an unknown dictionary; a file that cannot be opened.
Result<LensCalibration> calibrate_lens(LensKind kind, const Target& target, std::size_t count,
                                       const std::function<Result<BoardPicture>(std::size_t)>& read,
                                       const Progress& progress);

/// The same from corners that were found already. `dropped` so far; `width_px` x `height_px` pictures.
Result<LensCalibration> calibrate_views(LensKind kind, BoardSize board, int width_px, int height_px,
                                        const ImageCircle& circle, std::vector<BoardView> views,
                                        std::vector<DroppedPicture> dropped, const Progress& progress);

/// rms_px, held_out_rms_px, lens with uncertainties; corners with their errors, each picture's error.
Report report_of(const LensCalibration& calibration);

} // namespace daylit::calibration
