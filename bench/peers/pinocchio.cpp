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

namespace pin = pinocchio;
using Eigen::Map;
using Eigen::VectorXd;

namespace {

struct Robot {
  pin::Model model;
  pin::Data data;
  pin::FrameIndex tool = 0;
  // One entry for each state.
  std::vector<VectorXd> q, v, a;
};

pin::SE3 placement(const double *numbers) {  // rotation row by row, then translation
  const Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>> rotation(numbers);
  return pin::SE3(rotation, Map<const Eigen::Vector3d>(numbers + 9));
}

pin::JointIndex add_joint(pin::Model &model, const std::string &kind, std::size_t parent,
                          const pin::SE3 &at, const double *axis, const std::string &name) {
  const Map<const Eigen::Vector3d> along(axis);
  if (kind == "JointModelFreeFlyer") return model.addJoint(parent, pin::JointModelFreeFlyer(), at, name);
  if (kind == "JointModelRX") return model.addJoint(parent, pin::JointModelRX(), at, name);
  if (kind == "JointModelRY") return model.addJoint(parent, pin::JointModelRY(), at, name);
  if (kind == "JointModelRZ") return model.addJoint(parent, pin::JointModelRZ(), at, name);
  if (kind == "JointModelPX") return model.addJoint(parent, pin::JointModelPX(), at, name);
  if (kind == "JointModelPY") return model.addJoint(parent, pin::JointModelPY(), at, name);
  if (kind == "JointModelPZ") return model.addJoint(parent, pin::JointModelPZ(), at, name);
  if (kind == "JointModelRevoluteUnaligned")
    return model.addJoint(parent, pin::JointModelRevoluteUnaligned(along), at, name);
  return model.addJoint(parent, pin::JointModelPrismaticUnaligned(along), at, name);
}

void inverse_dynamics(Robot &robot, std::size_t k, double *out) {
  const VectorXd &torques = pin::rnea(robot.model, robot.data, robot.q[k], robot.v[k], robot.a[k]);
  std::memcpy(out, torques.data(), sizeof(double) * torques.size());
}

void tool_kinematics(Robot &robot, std::size_t k, double *out) {
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

void payload_rows(Robot &robot, std::size_t k, double *out) {
  pin::forwardKinematics(robot.model, robot.data, robot.q[k], robot.v[k], robot.a[k]);
  const pin::Frame &frame = robot.model.frames[robot.tool];
  const pin::JointIndex joint = frame.parentJoint;
  const pin::Motion velocity = frame.placement.actInv(robot.data.v[joint]);
  pin::Motion acceleration = frame.placement.actInv(robot.data.a[joint]);
  const Eigen::Matrix3d rotation = robot.data.oMi[joint].rotation() * frame.placement.rotation();
  acceleration.linear() -= rotation.transpose() * robot.model.gravity.linear();
  Map<Eigen::Matrix<double, 6, 10>> rows(out);
  pin::bodyRegressor(velocity, acceleration, rows);
}

void torque_regressor(Robot &robot, std::size_t k, double *out) {
  const auto &rows = pin::computeJointTorqueRegressor(robot.model, robot.data, robot.q[k], robot.v[k], robot.a[k]);
  std::memcpy(out, rows.data(), sizeof(double) * rows.size());
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

// `joints` has for each joint its placement (12), its axis (3) and the inertia of its body (10, dynamic parameters);
// `states` has for each state q, v and a.
void *pinocchio_new(std::size_t joint_count, const char *const *kinds, const std::size_t *parents,
                    const double *joints, std::size_t tool_parent, const double *tool_placement,
                    const double *states, std::size_t count) {
  auto *robot = new Robot;
  for (std::size_t joint = 0; joint < joint_count; ++joint) {
    const double *numbers = joints + 25 * joint;
    const auto index = add_joint(robot->model, kinds[joint], parents[joint], placement(numbers), numbers + 12,
                                 "joint_" + std::to_string(joint));
    const Map<const Eigen::Matrix<double, 10, 1>> parameters(numbers + 15);
    robot->model.appendBodyToJoint(index, pin::Inertia::FromDynamicParameters(parameters), pin::SE3::Identity());
  }
  robot->tool = robot->model.addFrame(
      pin::Frame("tool", tool_parent, 0, placement(tool_placement), pin::OP_FRAME));
  robot->data = pin::Data(robot->model);
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
  static const std::map<std::string, void (*)(Robot &, std::size_t, double *)> kernels = {
      {"inverse_dynamics", inverse_dynamics},
      {"tool_kinematics", tool_kinematics},
      {"payload_rows", payload_rows},
      {"torque_regressor", torque_regressor},
  };
  Robot &robot = *static_cast<Robot *>(handle);
  const auto found = kernels.find(name);
  if (found == kernels.end()) return false;
  const std::size_t each = len / robot.q.size();
  for (std::size_t repetition = 0; repetition < repetitions; ++repetition)
    for (std::size_t k = 0; k < robot.q.size(); ++k) found->second(robot, k, out + k * each);
  return true;
}
}
