// Kernels of Pinocchio in C++ behind the C interface of bench/src/lib.rs. Pinocchio's algorithms are templates, so that this
// file alone is compiled: no library of the wheel is linked, and -march=native holds for all of it.
//
// The model comes from Pinocchio's reader of URDF in Python, as plain numbers.

#include <cstddef>
#include <cstring>
#include <map>
#include <string>
#include <vector>

#include <pinocchio/algorithm/frames.hpp>
#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/regressor.hpp>
#include <pinocchio/algorithm/rnea.hpp>

#include "robot.hpp"

namespace {

// A robot and its states, an entry for each.
struct States : Robot {
  std::vector<VectorXd> q, v, a;
};

void inverse_dynamics(States &robot, std::size_t k, double *out) {
  const VectorXd &torques = pin::rnea(robot.model, robot.data, robot.q[k], robot.v[k], robot.a[k]);
  std::memcpy(out, torques.data(), sizeof(double) * torques.size());
}

void tool_kinematics(States &robot, std::size_t k, double *out) {
  pin::forwardKinematics(robot.model, robot.data, robot.q[k], robot.v[k], robot.a[k]);
  const pin::SE3 &pose = pin::updateFramePlacement(robot.model, robot.data, robot.tool);
  const auto velocity = pin::getFrameVelocity(robot.model, robot.data, robot.tool, pin::LOCAL_WORLD_ALIGNED);
  const auto acceleration =
      pin::getFrameClassicalAcceleration(robot.model, robot.data, robot.tool, pin::LOCAL_WORLD_ALIGNED);
  std::memcpy(out, pose.translation().data(), sizeof(double) * 3);
  std::memcpy(out + 3, pose.rotation().data(), sizeof(double) * 9);
  std::memcpy(out + 12, velocity.toVector().data(), sizeof(double) * 6);
  std::memcpy(out + 18, acceleration.toVector().data(), sizeof(double) * 6);
}

void payload_rows(States &robot, std::size_t k, double *out) {
  pin::forwardKinematics(robot.model, robot.data, robot.q[k], robot.v[k], robot.a[k]);
  body_rows(robot, Map<Eigen::Matrix<double, 6, 10>>(out));
}

void torque_regressor(States &robot, std::size_t k, double *out) {
  const auto &rows = pin::computeJointTorqueRegressor(robot.model, robot.data, robot.q[k], robot.v[k], robot.a[k]);
  std::memcpy(out, rows.data(), sizeof(double) * rows.size());
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

// `states` has for each state q, v and a; the others are those of `build`.
void *pinocchio_new(std::size_t joint_count, const char *const *kinds, const std::size_t *parents,
                    const double *joints, std::size_t tool_parent, const double *tool_placement,
                    const double *states, std::size_t count) {
  auto *robot = new States;
  build(*robot, joint_count, kinds, parents, joints, tool_parent, tool_placement);
  const auto nq = robot->model.nq, nv = robot->model.nv;
  for (std::size_t k = 0; k < count; ++k) {
    const double *state = states + k * (nq + 2 * nv);
    robot->q.push_back(Map<const VectorXd>(state, nq));
    robot->v.push_back(Map<const VectorXd>(state + nq, nv));
    robot->a.push_back(Map<const VectorXd>(state + nq + nv, nv));
  }
  return robot;
}

bool pinocchio_run(void *handle, const char *name, std::size_t repetitions, double *out, std::size_t len) {
  static const std::map<std::string, void (*)(States &, std::size_t, double *)> kernels = {
      {"inverse_dynamics", inverse_dynamics},
      {"tool_kinematics", tool_kinematics},
      {"payload_rows", payload_rows},
      {"torque_regressor", torque_regressor},
  };
  States &robot = *static_cast<States *>(handle);
  const auto found = kernels.find(name);
  if (found == kernels.end()) return false;
  const std::size_t each = len / robot.q.size();
  for (std::size_t repetition = 0; repetition < repetitions; ++repetition)
    for (std::size_t k = 0; k < robot.q.size(); ++k) found->second(robot, k, out + k * each);
  return true;
}
}
