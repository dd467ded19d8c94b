// The model of Pinocchio that its kernels compute with, from plain numbers: Pinocchio's reader of URDF in Python has read it.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

#include <pinocchio/algorithm/kinematics.hpp>
#include <pinocchio/algorithm/regressor.hpp>

namespace pin = pinocchio;
using Eigen::Map;
using Eigen::VectorXd;

namespace {

// A model with the frame of its tool, and the state of its computations.
struct Robot {
  pin::Model model;
  pin::Data data;
  pin::FrameIndex tool = 0;
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
  if (kind == "JointModelPrismaticUnaligned")
    return model.addJoint(parent, pin::JointModelPrismaticUnaligned(along), at, name);
  throw std::invalid_argument("no joint of the kind " + kind);
}

// `joints` has for each joint its placement (12), its axis (3) and the inertia of its body (10, dynamic parameters).
void build(Robot &robot, std::size_t joint_count, const char *const *kinds, const std::size_t *parents,
           const double *joints, std::size_t tool_parent, const double *tool_placement) {
  for (std::size_t joint = 0; joint < joint_count; ++joint) {
    const double *numbers = joints + 25 * joint;
    const auto index = add_joint(robot.model, kinds[joint], parents[joint], placement(numbers), numbers + 12,
                                 "joint_" + std::to_string(joint));
    const Map<const Eigen::Matrix<double, 10, 1>> parameters(numbers + 15);
    robot.model.appendBodyToJoint(index, pin::Inertia::FromDynamicParameters(parameters), pin::SE3::Identity());
  }
  robot.tool = robot.model.addFrame(
      pin::Frame("tool", tool_parent, 0, placement(tool_placement), pin::OP_FRAME));
  robot.data = pin::Data(robot.model);
}

// The 6x10 regressor of a payload at the tool, for the kinematics that `data` has.
template <typename Rows>
void body_rows(const Robot &robot, const Rows &rows) {
  const pin::Frame &frame = robot.model.frames[robot.tool];
  const pin::JointIndex joint = frame.parentJoint;
  const pin::Motion velocity = frame.placement.actInv(robot.data.v[joint]);
  pin::Motion acceleration = frame.placement.actInv(robot.data.a[joint]);
  const Eigen::Matrix3d rotation = robot.data.oMi[joint].rotation() * frame.placement.rotation();
  acceleration.linear() -= rotation.transpose() * robot.model.gravity.linear();
  pin::bodyRegressor(velocity, acceleration, const_cast<Rows &>(rows));
}

}  // namespace
