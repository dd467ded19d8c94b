// Online estimators as a textbook has them, with Eigen, behind the C interface of bench/src/lib.rs: normalised least mean
// squares, and recursive least squares on the covariance.

#include <cstddef>
#include <string>

#include <Eigen/Core>

namespace {

using Row = Eigen::Matrix<double, 10, 1>;
using Rows = Eigen::Map<const Eigen::Matrix<double, 11, Eigen::Dynamic>>;

Row nlms(const Rows &rows) {
  const double alpha = 1.8, beta = 0.9;
  Row weights = Row::Zero();
  for (Eigen::Index k = 0; k < rows.cols(); ++k) {
    const Row row = rows.col(k).head<10>();
    const double error = rows(10, k) - row.dot(weights);
    weights += row * (alpha / (beta + row.squaredNorm()) * error);
  }
  return weights;
}

Row rls(const Rows &rows) {
  Eigen::Matrix<double, 10, 10> covariance = Eigen::Matrix<double, 10, 10>::Identity() * 1e8;
  Row weights = Row::Zero();
  for (Eigen::Index k = 0; k < rows.cols(); ++k) {
    const Row row = rows.col(k).head<10>();
    const Row product = covariance * row;
    const Row gain = product / (1.0 + row.dot(product));
    weights += gain * (rows(10, k) - row.dot(weights));
    covariance.noalias() -= gain * product.transpose();
  }
  return weights;
}

}  // namespace

#pragma GCC visibility push(default)
extern "C" bool estimator_run(const char *name, const double *numbers, std::size_t count,
                                 std::size_t repetitions, double *out) {
  const std::string which(name);
  if (which != "nlms" && which != "rls") return false;
  const auto estimator = which == "nlms" ? nlms : rls;
  const Rows rows(numbers, 11, static_cast<Eigen::Index>(count));
  Eigen::Map<Row> parameters(out);
  for (std::size_t repetition = 0; repetition < repetitions; ++repetition) {
    parameters = estimator(rows);
    asm volatile("" : : : "memory");
  }
  return true;
}
