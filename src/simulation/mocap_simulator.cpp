#include "softarm/simulation/mocap_simulator.hpp"

#include <cmath>
#include <stdexcept>
#include <string>

#include "softarm/base/time.hpp"

namespace softarm {
namespace {

enum Stream : std::uint64_t { noise_stream = 1, dropout_stream = 2 };

void expect(bool holds, const char* key, const char* expected, double got) {
  if (!holds) {
    throw std::invalid_argument(std::string("mocap.") + key + ": expected " + expected + ", got " +
                                std::to_string(got));
  }
}

const MocapSettings& checked(const MocapSettings& settings, int segments) {
  const auto not_negative = [](double value) { return std::isfinite(value) && value >= 0.0; };
  expect(settings.rate_hz > 0.0 && settings.rate_hz <= 1e6, "rate_hz", "a rate in (0, 1e6] Hz",
         settings.rate_hz);
  expect(not_negative(settings.latency_s), "latency_s", "a finite time >= 0", settings.latency_s);
  expect(settings.latency_s * settings.rate_hz <= 1e5, "latency_s", "at most 1e5 frames",
         settings.latency_s * settings.rate_hz);
  expect(not_negative(settings.position_noise_m), "position_noise_m", "a finite length >= 0",
         settings.position_noise_m);
  expect(not_negative(settings.orientation_noise_rad), "orientation_noise_rad",
         "a finite angle >= 0", settings.orientation_noise_rad);
  expect(settings.dropout_probability >= 0.0 && settings.dropout_probability <= 1.0,
         "dropout_probability", "a probability", settings.dropout_probability);
  expect(segments >= 1 && segments <= kMaxSegments, "segments",
         ("1.." + std::to_string(kMaxSegments) + " segments").c_str(), segments);
  return settings;
}

}  // namespace

MocapSimulator::MocapSimulator(const MocapSettings& settings, int segments, std::uint64_t seed,
                               std::int64_t start_ns)
    : settings_(checked(settings, segments)),
      segments_(segments),
      start_ns_(start_ns),
      latency_ns_(to_ns(settings.latency_s)),
      next_capture_ns_(start_ns),
      noise_(seed, noise_stream),
      dropouts_(seed, dropout_stream),
      queue_(static_cast<std::size_t>(std::ceil(settings.latency_s * settings.rate_hz)) + kSlack) {}

void MocapSimulator::schedule() noexcept {
  const double seconds = static_cast<double>(captured_) / settings_.rate_hz;
  next_capture_ns_ = start_ns_ + to_ns(seconds);
}

BodyPose MocapSimulator::sense(const Eigen::Isometry3d& pose, bool noisy) noexcept {
  BodyPose body;
  body.position_m = pose.translation();
  body.orientation = Eigen::Quaterniond(pose.linear());
  body.valid = true;
  if (noisy && settings_.position_noise_m > 0.0) {
    for (int axis = 0; axis < 3; ++axis) {
      body.position_m[axis] += settings_.position_noise_m * noise_.normal();
    }
  }
  if (noisy && settings_.orientation_noise_rad > 0.0) {
    Eigen::Vector3d rotation;
    for (int axis = 0; axis < 3; ++axis) {
      rotation[axis] = settings_.orientation_noise_rad * noise_.normal();
    }
    const double half = 0.5 * rotation.norm();
    // sin(x)/x loses nothing near zero once the argument itself is not zero.
    const double scale = half > 0.0 ? 0.5 * std::sin(half) / half : 0.5;
    const Eigen::Vector3d xyz = scale * rotation;
    body.orientation =
        body.orientation * Eigen::Quaterniond(std::cos(half), xyz.x(), xyz.y(), xyz.z());
  }
  if (settings_.position_resolution_m > 0.0) {
    for (int axis = 0; axis < 3; ++axis) {
      const double step = settings_.position_resolution_m;
      body.position_m[axis] = step * std::round(body.position_m[axis] / step);
    }
  }
  body.orientation.normalize();
  return body;
}

void MocapSimulator::capture(const Eigen::Isometry3d& base,
                             std::span<const Eigen::Isometry3d> segment_ends) noexcept {
  const std::int64_t frame_number = captured_;
  const std::int64_t capture_ns = next_capture_ns_;
  ++captured_;
  schedule();
  if (settings_.dropout_probability > 0.0 && dropouts_.uniform() < settings_.dropout_probability) {
    ++dropped_;
    return;
  }
  if (waiting_ == queue_.size()) {
    oldest_ = (oldest_ + 1) % queue_.size();
    --waiting_;
    ++overwritten_;
  }
  MocapFrame& frame = queue_[(oldest_ + waiting_) % queue_.size()];
  ++waiting_;
  frame.frame_number = frame_number;
  frame.capture_ns = capture_ns;
  frame.segments = segments_;
  frame.body[0] = sense(base, settings_.noise_on_base);
  for (int i = 0; i < segments_; ++i) {
    const auto index = static_cast<std::size_t>(i);
    frame.body[index + 1] = sense(segment_ends[index], true);
  }
}

std::int64_t MocapSimulator::next_arrival_ns() const noexcept {
  return waiting_ == 0 ? kForever : queue_[oldest_].capture_ns + latency_ns_;
}

bool MocapSimulator::receive(std::int64_t now_ns, MocapFrame& frame) noexcept {
  if (next_arrival_ns() > now_ns) {
    return false;
  }
  frame = queue_[oldest_];
  oldest_ = (oldest_ + 1) % queue_.size();
  --waiting_;
  return true;
}

}  // namespace softarm
