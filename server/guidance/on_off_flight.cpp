#define EIGEN_NO_DEBUG  // the innermost loop of a plan
#include "server/guidance/on_off_flight.hpp"

#include "server/guidance/on_off_variation.hpp"

namespace slew {

namespace {

// A sphere under a constant torque: its rate is linear in time and changes of it stay what they are, so that
// of Y only the integral of C^T is left. x = (q, w, that integral).
struct SphereVariation {
  static constexpr bool kHasResponse = false;
  using State = Eigen::Matrix<double, 16, 1>;

  explicit SphereVariation(const ManeuverBody& given) : body(given) {}

  const ManeuverBody& body;
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();

  void operator()(int, const State& x, State& dx) const {
    const double a = x[0], b = x[1], c = x[2], d = x[3], u = 0.5 * x[4], v = 0.5 * x[5], w = 0.5 * x[6];
    dx[0] = -(b * u + c * v + d * w);
    dx[1] = a * u + c * w - d * v;
    dx[2] = a * v + d * u - b * w;
    dx[3] = a * w + b * v - c * u;
    dx.segment<3>(4) = acceleration;
    const double aa = a * a, bb = b * b, cc = c * c, dd = d * d;
    const double bc = b * c, ad = a * d, bd = b * d, ac = a * c, cd = c * d, ab = a * b;
    dx[7] = aa + bb - cc - dd, dx[8] = 2 * (bc + ad), dx[9] = 2 * (bd - ac);
    dx[10] = 2 * (bc - ad), dx[11] = aa - bb + cc - dd, dx[12] = 2 * (cd + ab);
    dx[13] = 2 * (bd + ac), dx[14] = 2 * (cd - ab), dx[15] = aa - bb - cc + dd;
  }

  void set_torque(const Eigen::Vector3d& given) {
    torque = given;
    acceleration = body.inverse(0, 0) * given;
  }

  State start(const RigidState& given) const {
    State x = State::Zero();
    x.head<4>() = given.attitude;
    x.segment<3>(4) = given.rate_rad_s;
    return x;
  }

  static FlownPoint point(double time_s, const State& x) {
    FlownPoint point;
    point.time_s = time_s;
    point.attitude = x.head<4>();
    point.rate_rad_s = x.segment<3>(4);
    point.transition.setIdentity();
    point.transition.topRightCorner<3, 3>() = Eigen::Map<const Eigen::Matrix3d>(x.data() + 7);
    return point;
  }

  Eigen::Vector3d acceleration = Eigen::Vector3d::Zero();
};

}  // namespace

double consumption_of(const OnOffProgram& program, const RigidManeuverPlant& plant) {
  double consumed = 0;
  for (std::size_t i = 0; i < program.controls.size(); ++i) {
    const std::vector<double>&values = program.controls[i], &times_s = program.switch_times_s[i];
    for (std::size_t k = 0; k < values.size(); ++k) {
      const double from = k == 0 ? 0 : times_s[k - 1];
      const double to = k + 1 == values.size() ? program.end_s : times_s[k];
      consumed += plant.consumption(static_cast<Eigen::Index>(i)) * std::abs(values[k]) * (to - from);
    }
  }
  return consumed;
}

void OnOffFlight::fly(const OnOffProgram& program, const RigidState& start, double finest_s,
                      bool with_middles) {
  if (body_->is_sphere)
    fly_as<SphereVariation>(program, start, finest_s, with_middles);
  else if (body_->plant.is_free())
    fly_as<Variation<3>>(program, start, finest_s, with_middles);
  else
    fly_as<Variation<6>>(program, start, finest_s, with_middles);
}

void OnOffFlight::fly(const OnOffProgram& program, const RigidState& start, bool with_middles) {
  fly(program, start, 0, with_middles);
}

void OnOffFlight::fly_finely(const OnOffProgram& program, const RigidState& start, double finest_s) {
  fly(program, start, finest_s, false);
}

Eigen::Matrix<double, 6, 1> OnOffFlight::drift_at(const FlownPoint& point,
                                                  const Eigen::VectorXd& control) const {
  Eigen::Matrix<double, 6, 1> drift;
  drift.head<3>() = rotation_matrix_of<double>(point.attitude).transpose() * point.rate_rad_s;
  drift.tail<3>() = rigid_rate<double>(body_->plant, body_->inverse, point.attitude, point.rate_rad_s,
                                       body_->plant.influence_N_m * control)
                        .acceleration_rad_s2;
  return drift;
}

Eigen::Matrix<double, 6, 6> inverse_transition(const Eigen::Matrix<double, 6, 6>& transition, bool is_free) {
  if (!is_free) return transition.inverse();
  Eigen::Matrix<double, 6, 6> inverse = Eigen::Matrix<double, 6, 6>::Identity();
  const Eigen::Matrix3d rate = transition.bottomRightCorner<3, 3>().inverse();
  inverse.bottomRightCorner<3, 3>() = rate;
  inverse.topRightCorner<3, 3>() = -transition.topRightCorner<3, 3>() * rate;
  return inverse;
}

}  // namespace slew
