// Copyright the authors of tactid. Licensed under MIT or Apache-2.0, at your option.
//
// The C interface of tactid for C++17: owns the handle, and returns results instead of throwing exceptions.
// tactid.h documents units, frames, signs and threads. Methods that are `noexcept` throw nothing and, where tactid.h says
// so, allocate nothing.
#ifndef TACTID_HPP
#define TACTID_HPP

#include <cassert>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <variant>
#include <vector>

#include "tactid.h"

namespace tactid {

/// Why a call failed.
struct Error {
  tactid_status status;
  std::string message;  ///< In English.
};

/// A value, or why there is none: the part of C++23's `std::expected` that works without exceptions.
template <typename T>
class Result {
 public:
  Result(T value) : content_(std::move(value)) {}
  Result(Error error) : content_(std::move(error)) {}

  bool has_value() const noexcept { return content_.index() == 0; }
  explicit operator bool() const noexcept { return has_value(); }
  /// Returns the value, which must be there.
  T& operator*() noexcept { return *checked(std::get_if<0>(&content_)); }
  const T& operator*() const noexcept { return *checked(std::get_if<0>(&content_)); }
  T* operator->() noexcept { return &**this; }
  const T* operator->() const noexcept { return &**this; }
  /// Returns the error, which must be there.
  const Error& error() const noexcept { return *checked(std::get_if<1>(&content_)); }

 private:
  template <typename U>
  static U* checked(U* pointer) noexcept {
    assert(pointer != nullptr);
    return pointer;
  }

  std::variant<T, Error> content_;
};

/// A struct of tactid.h with its `size`, everything else zero: the defaults.
template <typename T>
T sized() noexcept {
  T made{};
  made.size = sizeof(T);
  return made;
}

/// Options, all of them with their defaults.
inline tactid_options options() noexcept { return sized<tactid_options>(); }

/// A sample without arrays, which the caller adds.
inline tactid_sample sample() noexcept { return sized<tactid_sample>(); }

/// Whether a status is an error.
constexpr bool failed(tactid_status status) noexcept { return static_cast<int32_t>(status) < 0; }

/// An online identifier of one payload on one robot. It moves, and ends with its last owner.
class Identifier {
 public:
  /// Creates an identifier for the robot of a URDF (its text), its end-effector link and the names of the joints in the
  /// order in which samples have them.
  static Result<Identifier> create(const std::string& urdf, const std::string& tip,
                                   const std::vector<std::string>& joints,
                                   const tactid_options& options = tactid::options()) {
    std::vector<const char*> names;
    for (const std::string& joint : joints) {
      names.push_back(joint.c_str());
    }
    tactid_identifier* made = nullptr;
    const tactid_status status = tactid_identifier_new(urdf.c_str(), tip.c_str(), names.data(),
                                                       names.size(), &options, &made);
    if (failed(status)) {
      return Error{status, last_error()};
    }
    return Identifier(made);
  }

  /// Adds one sample; see `tactid_identifier_push`.
  tactid_status push(const tactid_sample& sample) noexcept {
    return tactid_identifier_push(handle_.get(), &sample);
  }

  /// Completes the update by the most recent window.
  tactid_status finish() noexcept { return tactid_identifier_finish(handle_.get()); }

  /// Returns what is known now; nothing after an error of tactid itself.
  std::optional<tactid_estimate> estimate() const noexcept {
    auto estimate = sized<tactid_estimate>();
    const bool is_written = !failed(tactid_identifier_estimate(handle_.get(), &estimate));
    return is_written ? std::optional(estimate) : std::nullopt;
  }

  /// Returns the offset of the wrenches; nothing where it is not known.
  std::optional<tactid_wrench> wrench_offset() const noexcept {
    return known(tactid_identifier_wrench_offset);
  }

  /// Returns the wrench by which the robot carries and accelerates the payload; nothing where it is not known.
  std::optional<tactid_wrench> load_wrench() const noexcept {
    return known(tactid_identifier_load_wrench);
  }

  /// Returns the wrench of a contact, with the sign of the measured wrenches; nothing where it is not known.
  std::optional<tactid_wrench> contact_wrench() const noexcept {
    return known(tactid_identifier_contact_wrench);
  }

  /// Holds the payload or ends that; returns whether that is possible, see `tactid_identifier_hold_payload`.
  bool hold_payload(bool is_held) noexcept {
    return tactid_identifier_hold_payload(handle_.get(), is_held) == TACTID_STATUS_OK;
  }

  /// Sets the zero of the sensor; returns whether that is possible, see `tactid_identifier_tare`.
  bool tare() noexcept { return tactid_identifier_tare(handle_.get()) == TACTID_STATUS_OK; }

 private:
  struct Free {
    void operator()(tactid_identifier* handle) const noexcept { tactid_identifier_free(handle); }
  };

  std::optional<tactid_wrench> known(tactid_status (*ask)(const tactid_identifier*, tactid_wrench*)) const noexcept {
    auto wrench = sized<tactid_wrench>();
    const bool is_known = ask(handle_.get(), &wrench) == TACTID_STATUS_OK;
    return is_known ? std::optional(wrench) : std::nullopt;
  }

  friend class Snapshot;

  explicit Identifier(tactid_identifier* handle) noexcept : handle_(handle) {}

  static std::string last_error() {
    std::string text(tactid_last_error(nullptr, 0), '\0');
    tactid_last_error(text.data(), text.size());
    text.pop_back();
    return text;
  }

  std::unique_ptr<tactid_identifier, Free> handle_;
};

/// What the findings of an identifier follow from: the control loop updates it, another thread reads the findings.
class Snapshot {
 public:
  /// Creates a snapshot of an identifier.
  static Result<Snapshot> create(const Identifier& identifier) {
    tactid_snapshot* made = nullptr;
    const tactid_status status = tactid_snapshot_new(identifier.handle_.get(), &made);
    if (failed(status)) return error(status);
    return Snapshot(made);
  }

  /// Updates the snapshot by the identifier of which it was made, while no other thread uses the snapshot.
  tactid_status update(const Identifier& identifier) noexcept {
    return tactid_snapshot_update(handle_.get(), identifier.handle_.get());
  }

  /// Returns what the most recent samples show about the assumptions, a line each; empty where nothing is wrong.
  Result<std::string> findings() const {
    std::string text(4096, '\0');
    std::size_t needed = 1;
    auto status = tactid_snapshot_findings(handle_.get(), text.data(), text.size(), &needed);
    if (!failed(status) && needed > text.size()) {
      text.resize(needed);
      status = tactid_snapshot_findings(handle_.get(), text.data(), text.size(), &needed);
    }
    if (failed(status)) return error(status);
    text.resize(needed - 1);
    return text;
  }

 private:
  struct Free {
    void operator()(tactid_snapshot* handle) const noexcept { tactid_snapshot_free(handle); }
  };

  explicit Snapshot(tactid_snapshot* handle) noexcept : handle_(handle) {}

  static Error error(tactid_status status) { return {status, tactid_status_text(static_cast<int32_t>(status))}; }

  std::unique_ptr<tactid_snapshot, Free> handle_;
};

}  // namespace tactid

#endif  // TACTID_HPP
