// The online update as a plain loop with Eigen and Pinocchio: samples of joints and of a wrench sensor at the tool are
// differentiated, give rows (29) and (37) of Hou et al. 2016, are averaged over windows, and update the information of the
// payload's ten parameters. The filters are those of tactid, so that the mean rows are the same; the weights of the channels are
// constants of the sensor, and there is no uncertainty, no robust weight and no check.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <string>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "robot.hpp"

namespace {

constexpr int kJoints = 6;
constexpr int kNodes = 11;             // samples of a polynomial of degree four, every second one
constexpr int kRing = 2 * kNodes - 1;  // samples that are stored
constexpr int kOverlap = 3;            // windows that overlap
constexpr double kLength = 0.0926;     // of a window for a cutoff of 10 Hz, s
constexpr double kForceNoise = 0.5, kMomentNoise = 0.02;  // standard deviations of the sensor, N and N m
constexpr std::size_t kNumbers = 1 + 2 * kJoints + 6;     // of a sample

using Joints = Eigen::Matrix<double, kJoints, 1>;
using Weights = Eigen::Matrix<double, kNodes, 1>;
using Entries = Eigen::Matrix<double, 6, 11>;  // the regressor, then the measured wrench

// Savitzky-Golay weights at the middle of the nodes.
struct Smoothing {
  Weights velocity, acceleration, displacement;

  explicit Smoothing(double step) {
    Eigen::Matrix<double, kNodes, 5> powers;
    Eigen::Matrix<double, 5, 1> integrals = Eigen::Matrix<double, 5, 1>::Zero();
    for (int k = 0; k < kNodes; ++k) {
      double power = 1.0;
      for (int order = 0; order < 5; ++order) {
        powers(k, order) = power;
        power *= k - kNodes / 2;
        integrals(order) += power / ((order + 1) * kNodes);
      }
    }
    const Eigen::Matrix<double, 5, kNodes> fit = (powers.transpose() * powers).inverse() * powers.transpose();
    velocity = fit.row(0).transpose();
    acceleration = fit.row(1).transpose() / step;
    displacement = fit.transpose() * integrals * step;
  }
};

// Mean rows over overlapping windows with weight cos^4.
class Rows {
 public:
  explicit Rows(Robot &robot, double step) : robot_(robot), smoothing_(2.0 * step) {
    for (auto &sum : sums_) sum.setZero();
  }

  // Adds a sample and returns whether it ends a window, whose rows are then `mean`.
  bool push(const double *sample) {
    newest_ = (newest_ + 1) % kRing;
    const Map<const Eigen::Matrix<double, kNumbers, 1>> numbers(sample);
    times_[newest_] = numbers(0);
    positions_.col(newest_) = numbers.segment<kJoints>(1);
    velocities_.col(newest_) = numbers.segment<kJoints>(1 + kJoints);
    wrenches_.col(newest_) = numbers.tail<6>();
    if (++count_ < kRing) return false;
    Joints q = Joints::Zero(), v = Joints::Zero(), a = Joints::Zero();
    int place = newest_ + 1;
    if (place >= kRing) place -= kRing;
    const int middle = (newest_ + 1 + kRing / 2) % kRing;
    for (int k = 0; k < kNodes; ++k) {
      const auto rates = velocities_.col(place);
      q.noalias() += positions_.col(place) - rates * (kNodes * smoothing_.displacement(k));
      v.noalias() += rates * smoothing_.velocity(k);
      a.noalias() += rates * smoothing_.acceleration(k);
      place += 2;
      if (place >= kRing) place -= kRing;
    }
    q /= kNodes;
    pin::forwardKinematics(robot_.model, robot_.data, q, v, a);
    Entries entries;
    auto regressor = entries.leftCols<10>();
    body_rows(robot_, regressor);
    entries.col(10) = wrenches_.col(middle);
    return average(times_[middle], entries);
  }

  const Entries &mean() const { return mean_; }

 private:
  bool average(double time, const Entries &entries) {
    if (count_ == kRing) {
      begin_ = previous_ = pending_time_ = time;
      pending_ = entries;
      return false;
    }
    bool ended = false;
    const double stride = kLength / kOverlap, step = 0.5 * (time - previous_);
    const int newest = static_cast<int>((pending_time_ - begin_) / stride);
    for (int number = std::max(0, newest - kOverlap + 1); number <= newest; ++number) {
      const int slot = number % kOverlap;
      if (number >= oldest_ + kOverlap) {
        ++oldest_;
        ended = true;
        mean_ = sums_[slot] / weights_[slot];
        sums_[slot].setZero();
        weights_[slot] = 0.0;
      }
      const double cosine = std::cos(M_PI * (pending_time_ - begin_ - (number + 1.5) * stride) / kLength);
      const double weight = cosine * cosine * cosine * cosine * step;
      sums_[slot].noalias() += weight * pending_;
      weights_[slot] += weight;
    }
    previous_ = pending_time_;
    pending_time_ = time;
    pending_ = entries;
    return ended;
  }

  Robot &robot_;
  Smoothing smoothing_;
  int newest_ = kRing - 1;
  long count_ = 0;
  std::array<double, kRing> times_;
  Eigen::Matrix<double, kJoints, kRing> positions_, velocities_;
  Eigen::Matrix<double, 6, kRing> wrenches_;
  double begin_ = 0.0, previous_ = 0.0, pending_time_ = 0.0;
  int oldest_ = 0;
  Entries pending_, mean_ = Entries::Zero();
  std::array<Entries, kOverlap> sums_;
  std::array<double, kOverlap> weights_{};
};

// Least squares by the information of all windows so far.
struct Information {
  Eigen::Matrix<double, 10, 10> information = Eigen::Matrix<double, 10, 10>::Identity() * 1e-12;
  Eigen::Matrix<double, 10, 1> target = Eigen::Matrix<double, 10, 1>::Zero();
  Eigen::Matrix<double, 10, 1> parameters = Eigen::Matrix<double, 10, 1>::Zero();

  void add(const Entries &mean) {
    Entries whitened = mean;
    whitened.topRows<3>() /= kForceNoise;
    whitened.bottomRows<3>() /= kMomentNoise;
    const auto regressor = whitened.leftCols<10>();
    information.noalias() += regressor.transpose() * regressor;
    target.noalias() += regressor.transpose() * whitened.col(10);
    parameters = information.ldlt().solve(target);
  }
};

void rows_of_last_window(Robot &robot, const double *samples, std::size_t count, double *out) {
  Rows rows(robot, samples[kNumbers] - samples[0]);
  for (std::size_t k = 0; k < count; ++k) rows.push(samples + k * kNumbers);
  Map<Entries> mean(out);
  mean = rows.mean();
}

void parameters_at_end(Robot &robot, const double *samples, std::size_t count, double *out) {
  Rows rows(robot, samples[kNumbers] - samples[0]);
  Information information;
  Map<Eigen::Matrix<double, 10, 1>> parameters(out);
  for (std::size_t k = 0; k < count; ++k) {
    if (rows.push(samples + k * kNumbers)) information.add(rows.mean());
    parameters = information.parameters;
    asm volatile("" : : : "memory");
  }
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" {

void *online_new(std::size_t joint_count, const char *const *kinds, const std::size_t *parents, const double *joints,
                 std::size_t tool_parent, const double *tool_placement) {
  auto *robot = new Robot;
  build(*robot, joint_count, kinds, parents, joints, tool_parent, tool_placement);
  return robot;
}

// Runs a kernel and returns whether there is one of this name. `samples` has for each of `count` samples a time, positions
// and velocities of the joints, and the wrench at the tool.
bool online_run(void *handle, const char *name, const double *samples, std::size_t count, std::size_t repetitions,
                double *out) {
  Robot &robot = *static_cast<Robot *>(handle);
  const std::string n = name;
  if (n != "rows" && n != "update") return false;
  const auto kernel = n == "rows" ? rows_of_last_window : parameters_at_end;
  for (std::size_t repetition = 0; repetition < repetitions; ++repetition) kernel(robot, samples, count, out);
  return true;
}
}
