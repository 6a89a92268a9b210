#pragma once

// Reflectances from photographs with a verdict: what daylit-calibrate materials says.

#include "calibration/material_fit.h"
#include "calibration/report.h"

namespace daylit::calibration {

struct MaterialCalibration {
  Report report;
  MaterialFit fit;
  Room room; ///< of the scene, with the reflectances that were found
};

/// `transport`: of the scene's room and skies. Errors: as fit_materials().
Result<MaterialCalibration> calibrate_materials(const MaterialScene& scene, RoomTransport& transport,
                                                const Progress& progress);

} // namespace daylit::calibration
