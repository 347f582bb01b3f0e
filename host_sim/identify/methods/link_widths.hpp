// methods - how far the CAD values of the links are off, read from the logs themselves (empirical Bayes).
#pragma once

#include "host_sim/identify/calibration/weighted_fit.hpp"

namespace armcal::calibration {

// Standard deviations of the CAD values of link j: w_j m of its mass, sqrt((w_j c)^2 + a^2) of a coordinate of its
// centre, sqrt((w_j I)^2 + (r tr)^2) of an inertia about its centre, tr being the trace of that inertia.
struct LinkWidths {
  Eigen::VectorXd relative;     // [n] w
  double center_m = 0;          // a
  double inertia_of_trace = 0;  // r
  Eigen::VectorXd sd;           // [11 n] what follows for (m, c, I about the centre); rotors as the table has them
};

// The most likely widths, given what the logs say of the base parameters. The base parameters' distance from the CAD
// values is Gaussian with the covariance of the logs plus that of the widths (type-II maximum likelihood, MacKay 1992);
// parameters of friction and gains are integrated out. Widths that the logs do not show stay near broad means: 15 % for
// w, next to nothing for a and r, and all links much alike. The map from bodies to base parameters is linearised again
// about the bodies found, twice. The file's own widths are not read. Throws io::InputError as ReadOutPhysical does.
LinkWidths EstimateLinkWidths(const codegen::Model& model, const Fit& fit);

// ReadOutPhysical with these widths in the place of the table's, and within these limits. A body parameter that the
// table holds is held.
PhysicalReadOut ReadOutWithWidths(const codegen::Model& model, const Fit& fit, const LinkWidths& widths,
                                  const std::vector<Limit>& limits = {});

}  // namespace armcal::calibration
