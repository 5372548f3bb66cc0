#include "softarm/recording/recording_import.hpp"

#include <fmt/format.h>

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <optional>
#include <softarm_messages/mocap_frame_t.hpp>
#include <softarm_messages/pressure_command_t.hpp>
#include <softarm_messages/pressure_measurement_t.hpp>
#include <stdexcept>

#include "softarm/estimation/pose_statistics.hpp"
#include "softarm/runtime/settings.hpp"
#include "softarm/transport/event_log.hpp"
#include "softarm/transport/pose_convention.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr double kMostRestSpread_m = 2e-3;  ///< an arm that moves more is not at rest

/// The rotation of the recording's axes to ours, z up; right-handed axes stay right-handed.
Eigen::Matrix3d to_z_up(UpAxis up) {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  if (up == UpAxis::x) rotation << 0, 0, -1, 0, 1, 0, 1, 0, 0;
  if (up == UpAxis::y) rotation << 1, 0, 0, 0, 0, -1, 0, 1, 0;
  return rotation;
}

/// The body of one row as given in the table; not valid where it was not seen (all zero, or not a
/// number). The norm of the quaternion is kept: the validator decides whether to accept it.
BodyPose body_in(const CsvTable& table, std::size_t row, const BodyColumns& body) {
  BodyPose pose;
  for (std::size_t i = 0; i < 3; ++i)
    pose.position_m[static_cast<Eigen::Index>(i)] = table.at(row, body.position[i]);
  for (std::size_t i = 0; i < 4; ++i)
    pose.orientation.coeffs()[static_cast<Eigen::Index>(i)] = table.at(row, body.orientation[i]);
  pose.valid = pose.position_m.allFinite() && pose.orientation.coeffs().allFinite() &&
               !pose.orientation.coeffs().isZero(0.0);
  return pose;
}

bool same_poses(const CsvTable& table, const RecordingMap& map, std::size_t a, std::size_t b) {
  const auto same = [&](std::size_t column) {
    const double one = table.at(a, column), other = table.at(b, column);
    return one == other || (std::isnan(one) && std::isnan(other));
  };
  return std::all_of(map.bodies.begin(), map.bodies.end(), [&](const BodyColumns& body) {
    return std::all_of(body.position.begin(), body.position.end(), same) &&
           std::all_of(body.orientation.begin(), body.orientation.end(), same);
  });
}

class Importer {
 public:
  /// @param frames  null: those of the recording's own rest window, if it has one
  Importer(const MappedTable& recording, const MarkerFrames* frames)
      : files_(recording.files),
        map_(recording.map),
        table_(recording.table),
        convention_(map_.bodies.size(), convention(Eigen::Isometry3d::Identity())) {
    drop_equal_times();
    check_times();
    check_pressures(map_.commanded);
    check_pressures(map_.measured);
    if (frames != nullptr) {
      use(*frames);
    } else if (map_.rest) {
      learn_rest();
    }
  }

  MarkerFrames frames() const { return frames_; }

  ImportSummary write(const std::filesystem::path& out) {
    EventLogWriter log(out, files_, OutputFile::Kind::document);
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      if (!map_.measured.empty()) append(log, map_.measurement_channel, row, measurement(row));
      if (!map_.commanded.empty()) append(log, map_.command_channel, row, command(row));
      append(log, map_.mocap_channel, row, frame(row));
    }
    log.close();
    summary_.rows = static_cast<std::int64_t>(table_.rows());
    summary_.duration_s = time_s(table_.rows() - 1) - time_s(0);
    return summary_;
  }

 private:
  double time_s(std::size_t row) const {
    return map_.time_unit_s * table_.at(row, map_.time_column);
  }
  std::int64_t time_us(std::size_t row) const { return std::llround(1e6 * time_s(row)); }

  /// Where the map says which of several rows with one time counts, the others go.
  void drop_equal_times() {
    if (map_.equal_times == EqualTimes::refuse) return;
    const std::size_t width = table_.columns.size();
    std::size_t kept = 0;
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      const bool equal =
          kept > 0 && table_.at(row, map_.time_column) == table_.at(kept - 1, map_.time_column);
      if (equal && map_.equal_times == EqualTimes::first) continue;
      if (!equal) ++kept;
      std::copy_n(table_.cells.begin() + static_cast<std::ptrdiff_t>(row * width), width,
                  table_.cells.begin() + static_cast<std::ptrdiff_t>((kept - 1) * width));
      table_.lines[kept - 1] = table_.lines[row];
    }
    table_.lines.resize(kept);
    table_.cells.resize(kept * width);
  }

  /// A pressure that is no number would be commanded as none.
  void check_pressures(const std::vector<std::size_t>& columns) {
    for (const std::size_t column : columns)
      for (std::size_t row = 0; row < table_.rows(); ++row) {
        double& value = table_.cells[row * table_.columns.size() + column];
        if (std::isfinite(value)) continue;
        if (row > 0 && map_.missing_pressure == MissingPressure::hold) {
          value = table_.at(row - 1, column);
          continue;
        }
        throw std::runtime_error(
            fmt::format("{}:{}: {}: expected a finite pressure, got {}{}", table_.file,
                        table_.lines[row], table_.columns[column], value,
                        row > 0 ? "; pressures.missing: hold takes that of the row before" : ""));
      }
  }

  void check_times() const {
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      const double t = time_s(row);
      const bool advances = row == 0 || t > time_s(row - 1);
      // LCM logs begin at 0, and the daemon's clocks are 64-bit nanoseconds.
      if (!(t >= 0.0 && t < 4e9) || !advances) {
        throw std::runtime_error(
            fmt::format("{}:{}: {}: expected a time in [0, 4e9) s after that of "
                        "the row before, got {} s",
                        table_.file, table_.lines[row], table_.columns[map_.time_column], t));
      }
    }
  }

  PoseConvention convention(const Eigen::Isometry3d& on_body) const {
    const Eigen::Quaterniond orientation(on_body.linear());
    return {map_.position_unit_m, to_z_up(map_.up), {on_body.translation(), orientation, true}};
  }

  BodyPose pose(std::size_t row, std::size_t body) const {
    return convention_[body].to_world(body_in(table_, row, map_.bodies[body]));
  }

  /// Rows of the rest window in which every body was seen, without those that repeat a frame.
  std::vector<std::size_t> rest_rows() const {
    std::vector<std::size_t> rows;
    for (std::size_t row = 0; row < table_.rows(); ++row) {
      const bool inside = time_s(row) >= map_.rest->from_s && time_s(row) <= map_.rest->to_s;
      const bool repeated = row > 0 && same_poses(table_, map_, row - 1, row);
      const bool seen = std::all_of(map_.bodies.begin(), map_.bodies.end(), [&](const auto& body) {
        return body_in(table_, row, body).valid;
      });
      if (inside && seen && !repeated) rows.push_back(row);
    }
    if (rows.empty()) {
      throw std::runtime_error(
          fmt::format("{}: expected a frame with every body in the window of "
                      "rest, {} to {} s, got none",
                      table_.file, map_.rest->from_s, map_.rest->to_s));
    }
    return rows;
  }

  /// The segment frames of an arm that hangs straight at rest, relative to the bodies.
  void learn_rest() {
    const std::vector<std::size_t> rows = rest_rows();
    summary_.rest_frames = static_cast<std::int64_t>(rows.size());
    std::vector<Eigen::Isometry3d> mean;
    for (std::size_t i = 0; i < map_.bodies.size(); ++i) mean.push_back(mean_pose(i, rows));
    ArmParameters arm;
    arm.base_position_m = mean[0].translation();
    arm.base_rotation = map_.base_rotation;
    for (std::size_t i = 1; i < map_.bodies.size(); ++i)
      arm.segments.push_back({.length_m = map_.bodies[i].length_m});
    use({frames_on_bodies(arm, Eigen::VectorXd::Zero(arm.dof()), mean), summary_.rest_frames,
         summary_.rest_spread_m});
  }

  void use(const MarkerFrames& frames) {
    if (frames.on_body.size() != map_.bodies.size())
      throw std::runtime_error(fmt::format("frames of {} bodies: expected those of {}",
                                           frames.on_body.size(), map_.bodies.size()));
    frames_ = frames;
    summary_.rest_frames = frames.rest_frames;
    summary_.rest_spread_m = frames.rest_spread_m;
    for (std::size_t i = 0; i < convention_.size(); ++i)
      convention_[i] = convention(frames.on_body[i]);
  }

  Eigen::Isometry3d mean_pose(std::size_t body, const std::vector<std::size_t>& rows) {
    MeanPose mean;
    for (const std::size_t row : rows) {
      const BodyPose seen = pose(row, body);
      mean.add(seen.position_m, seen.orientation);
    }
    for (const std::size_t row : rows)
      summary_.rest_spread_m =
          std::max(summary_.rest_spread_m, (pose(row, body).position_m - mean.position_m()).norm());
    if (summary_.rest_spread_m > kMostRestSpread_m)
      throw std::runtime_error(
          fmt::format("the arm moves by {:.1f} mm in the rest window of {} to {} s: expected less "
                      "than {:.0f} mm; "
                      "give rest.from_s and rest.to_s a window in which it hangs still",
                      1e3 * summary_.rest_spread_m, map_.rest->from_s, map_.rest->to_s,
                      1e3 * kMostRestSpread_m));
    return mean.pose();
  }

  softarm_messages::mocap_frame_t frame(std::size_t row) {
    if (row == 0 || !same_poses(table_, map_, row - 1, row)) {
      begin_frame(row);
    } else {
      ++summary_.repeated;
    }
    return frame_;
  }

  void begin_frame(std::size_t row) {
    std::int64_t steps = 1;
    if (summary_.frames > 0) {
      const double gap_s = time_s(row) - time_s(frame_row_);
      summary_.longest_gap_s = std::max(summary_.longest_gap_s, gap_s);
      if (map_.frame_period_s) {
        steps = std::max<std::int64_t>(
            1, std::llround(std::floor(gap_s / *map_.frame_period_s + 1e-6)));
      }
    }
    summary_.missing += steps - 1;
    ++summary_.frames;
    frame_row_ = row;
    frame_.frame_number += steps;
    frame_.capture_time_us = time_us(row);
    frame_.bodies.resize(map_.bodies.size());
    frame_.num_bodies = static_cast<std::int16_t>(map_.bodies.size());
    bool all_seen = true;
    for (std::size_t i = 0; i < map_.bodies.size(); ++i) {
      const BodyPose seen = pose(row, i);
      all_seen = all_seen && seen.valid;
      auto& body = frame_.bodies[i];
      body = {};
      body.id = map_.bodies[i].id;
      body.valid = seen.valid ? 1 : 0;
      if (!seen.valid) continue;
      for (int axis = 0; axis < 3; ++axis) body.position_m[axis] = seen.position_m[axis];
      body.orientation[0] = seen.orientation.w();
      body.orientation[1] = seen.orientation.x();
      body.orientation[2] = seen.orientation.y();
      body.orientation[3] = seen.orientation.z();
    }
    if (!all_seen) ++summary_.unseen;
  }

  std::vector<float> pressures(std::size_t row, const std::vector<std::size_t>& columns) const {
    std::vector<float> bar;
    for (const std::size_t column : columns) {
      bar.push_back(static_cast<float>(map_.pressure_unit_bar * table_.at(row, column)));
    }
    return bar;
  }

  softarm_messages::pressure_command_t command(std::size_t row) const {
    softarm_messages::pressure_command_t message{};
    message.sequence = static_cast<std::int64_t>(row) + 1;
    message.time_us = time_us(row);
    message.validity_us =
        static_cast<std::int32_t>(std::llround(1e6 * SafetySettings{}.command_validity_s));
    message.shadow = 1;
    message.pressure_bar = pressures(row, map_.commanded);
    message.num_chambers = static_cast<std::int16_t>(message.pressure_bar.size());
    return message;
  }

  softarm_messages::pressure_measurement_t measurement(std::size_t row) const {
    softarm_messages::pressure_measurement_t message{};
    message.sequence = map_.commanded.empty() ? -1 : static_cast<std::int64_t>(row) + 1;
    message.time_us = time_us(row);
    message.pressure_bar = pressures(row, map_.measured);
    message.num_chambers = static_cast<std::int16_t>(message.pressure_bar.size());
    return message;
  }

  template <class Message>
  void append(EventLogWriter& log, const std::string& channel, std::size_t row,
              const Message& message) {
    bytes_.resize(static_cast<std::size_t>(message.getEncodedSize()));
    message.encode(bytes_.data(), 0, static_cast<int>(bytes_.size()));
    log.write(time_us(row), channel, bytes_);
  }

  const Files& files_;
  const RecordingMap& map_;
  CsvTable table_;                          ///< a copy: rows may go, pressures may be held
  std::vector<PoseConvention> convention_;  // of every body, to the segment frame it carries
  MarkerFrames frames_;
  ImportSummary summary_;
  softarm_messages::mocap_frame_t frame_{};
  std::size_t frame_row_ = 0;
  std::vector<std::byte> bytes_;
};

}  // namespace

ImportSummary import_recording(const MappedTable& recording, const std::filesystem::path& out) {
  return Importer(recording, nullptr).write(out);
}

MarkerFrames marker_frames(const MappedTable& recording) {
  if (!recording.map.rest)
    throw std::runtime_error(
        fmt::format("{}: expected a map with a rest window", recording.table.file));
  return Importer(recording, nullptr).frames();
}

ImportSummary import_recording(const MappedTable& recording, const MarkerFrames& frames,
                               const std::filesystem::path& out) {
  return Importer(recording, &frames).write(out);
}

}  // namespace softarm
