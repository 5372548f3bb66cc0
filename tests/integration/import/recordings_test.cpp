// Both recordings of a real arm through `softarm import`: the log against an independent reading of
// the table, and what the estimator makes of it. Skipped where the recordings are not beside the
// project.
#include <Eigen/Geometry>
#include <cmath>
#include <complex>
#include <map>
#include <numbers>
#include <sstream>

#include "import_fixture.hpp"
#include "softarm/estimation/frame_validator.hpp"

namespace {

using softarm::test::read_log;
using softarm_messages::mocap_frame_t;

struct Recording {
  const char *table, *map;
  std::size_t rows;
  double most_repeated;  // fraction of rows, within 0.02
};

// The table as text: cells by column name, compared as strings.
class Text {
 public:
  explicit Text(const std::string& file) {
    std::ifstream stream(file);
    std::string line;
    std::getline(stream, line);
    const auto names = cells(line);
    for (std::size_t i = 0; i < names.size(); ++i) column_[names[i]] = i;
    while (std::getline(stream, line)) rows_.push_back(cells(line));
  }
  std::size_t rows() const { return rows_.size(); }
  std::string pose(std::size_t row, int body) const {
    std::string all;
    for (const char* part : {"x", "y", "z", "qx", "qy", "qz", "qw"}) {
      all += text(row, "mocap_" + std::to_string(body) + "_" + part) + " ";
    }
    return all;
  }
  double number(std::size_t row, const std::string& name) const {
    return std::stod(text(row, name));
  }
  Eigen::Vector3d position(std::size_t row, int body) const {
    const std::string prefix = "mocap_" + std::to_string(body) + "_";
    return {number(row, prefix + "x"), number(row, prefix + "y"), number(row, prefix + "z")};
  }
  Eigen::Vector4d orientation(std::size_t row, int body) const {
    const std::string prefix = "mocap_" + std::to_string(body) + "_";
    return {number(row, prefix + "qx"), number(row, prefix + "qy"), number(row, prefix + "qz"),
            number(row, prefix + "qw")};
  }

 private:
  static std::vector<std::string> cells(std::string line) {
    if (line.ends_with('\r')) line.pop_back();
    std::vector<std::string> out;
    std::istringstream stream(line);
    for (std::string cell; std::getline(stream, cell, ',');) out.push_back(cell);
    return out;
  }
  const std::string& text(std::size_t row, const std::string& name) const {
    return rows_.at(row).at(column_.at(name));
  }
  std::map<std::string, std::size_t> column_;
  std::vector<std::vector<std::string>> rows_;
};

/// Angle between two orientations, whatever their signs and norms; exact for small ones.
double angle(const Eigen::Vector4d& a, const Eigen::Vector4d& b) {
  const Eigen::Vector4d one = a.normalized();
  const Eigen::Vector4d other = one.dot(b) < 0.0 ? -b.normalized() : b.normalized();
  return 4.0 * std::atan2((one - other).norm(), (one + other).norm());
}

class Recorded : public softarm::test::ImportTest, public testing::WithParamInterface<Recording> {
 protected:
  void SetUp() override {
    csv = std::string(SOFTARM_SOURCE_DIR "/../shared/data/") + GetParam().table;
    if (!std::filesystem::exists(csv)) {
      GTEST_SKIP() << GetParam().table
                   << " is not there: the recordings are not part of the project";
    }
    const auto outcome =
        import(csv, std::string(SOFTARM_SOURCE_DIR "/config/recordings/") + GetParam().map);
    ASSERT_EQ(outcome.code, 0) << outcome.text;
    frames = read_log<mocap_frame_t>(path("log"), "SOFTARM_MOCAP");
  }

  /// u of every accepted frame, by the module that the daemon uses.
  struct Sample {
    double t;
    Eigen::Vector2d u;
    double twist, length_error;
  };
  std::vector<Sample> estimates() {
    softarm::ArmParameters arm;
    arm.segments.resize(1);
    arm.segments[0].length_m = 0.33;
    softarm::EstimationSettings settings;
    settings.position_noise_m = 0.1e-3;
    settings.orientation_noise_rad = 5e-4;
    softarm::FrameValidator validator(settings, arm, softarm::body_noise(settings, 1));
    std::vector<Sample> samples;
    for (const auto& [time_us, message] : frames) {
      softarm::MocapFrame frame;
      frame.frame_number = message.frame_number;
      frame.capture_ns = 1000 * message.capture_time_us;
      frame.segments = 1;
      for (std::size_t i = 0; i < 2; ++i) {
        const auto& body = message.bodies[i];
        frame.body[i] = {Eigen::Vector3d(body.position_m),
                         Eigen::Quaterniond(body.orientation[0], body.orientation[1],
                                            body.orientation[2], body.orientation[3]),
                         body.valid != 0};
      }
      if (validator.accept(frame) != softarm::FrameVerdict::accepted) continue;
      const auto& estimate = validator.estimate();
      samples.push_back({1e-6 * static_cast<double>(time_us), estimate.u_rad, estimate.twist_rad[0],
                         estimate.length_error_m[0]});
    }
    counters = validator.counters();
    return samples;
  }

  std::string csv;
  std::vector<softarm::test::Event<mocap_frame_t>> frames;
  softarm::FrameCounters counters;
};

TEST_P(Recorded, EveryRowIsThereAndRepeatedRowsAreRepeatedFrames) {
  const Text text(csv);
  ASSERT_EQ(text.rows(), GetParam().rows);
  ASSERT_EQ(frames.size(), text.rows());
  std::size_t repeated = 0;
  for (std::size_t k = 0; k < text.rows(); ++k) {
    EXPECT_NEAR(static_cast<double>(frames[k].time_us), 1e6 * text.number(k, "time"), 0.51);
    const auto& message = frames[k].message;
    ASSERT_EQ(message.num_bodies, 2);
    for (int body : {2, 3}) {
      const bool zero = text.position(k, body).isZero(0.0) && text.orientation(k, body).isZero(0.0);
      EXPECT_EQ(message.bodies[static_cast<std::size_t>(body - 2)].valid != 0, !zero)
          << "row " << k;
    }
    if (k == 0) continue;
    const bool same =
        text.pose(k, 2) == text.pose(k - 1, 2) && text.pose(k, 3) == text.pose(k - 1, 3);
    const auto& before = frames[k - 1].message;
    EXPECT_EQ(message.frame_number == before.frame_number, same) << "row " << k;
    EXPECT_GE(message.frame_number, before.frame_number);
    if (same) {
      EXPECT_EQ(message.capture_time_us, before.capture_time_us);
      ++repeated;
    }
  }
  EXPECT_NEAR(static_cast<double>(repeated) / static_cast<double>(text.rows()),
              GetParam().most_repeated, 0.02);
}

// What no choice of frames can change: how far and by how much each body has moved since an instant
// of reference.
TEST_P(Recorded, BodiesMoveAsInTheTable) {
  const Text text(csv);
  const std::size_t start = 5;
  for (std::size_t k = start; k < text.rows(); k += 7) {
    for (std::size_t i = 0; i < 2; ++i) {
      const auto& from = frames[start].message.bodies[i];
      const auto& to = frames[k].message.bodies[i];
      const int body = static_cast<int>(i) + 2;
      const double turned = angle(text.orientation(start, body), text.orientation(k, body));
      EXPECT_NEAR(angle(Eigen::Vector4d(from.orientation), Eigen::Vector4d(to.orientation)), turned,
                  2e-6);
      // y up became z up: (x, y, z) -> (x, -z, y). The frames sit up to 0.1 m from the bodies'
      // markers.
      const Eigen::Vector3d raw = text.position(k, body) - text.position(start, body);
      const Eigen::Vector3d moved =
          Eigen::Vector3d(to.position_m) - Eigen::Vector3d(from.position_m);
      EXPECT_LT((moved - Eigen::Vector3d(raw.x(), -raw.z(), raw.y())).norm(), 1e-5 + 0.1 * turned);
    }
  }
}

TEST_P(Recorded, TheArmHangsStraightBelowTheTopBodyAtRest) {
  const Text text(csv);
  for (std::size_t k = 0; k < text.rows() && text.number(k, "time") < 0.5; ++k) {
    if (!frames[k].message.bodies[0].valid) continue;
    const Eigen::Vector3d top(frames[k].message.bodies[0].position_m);
    const Eigen::Vector3d tip(frames[k].message.bodies[1].position_m);
    const Eigen::Vector3d raw = text.position(k, 2);
    EXPECT_LT((top - Eigen::Vector3d(raw.x(), -raw.z(), raw.y())).norm(), 0.1e-3);
    EXPECT_LT((top - tip - Eigen::Vector3d(0, 0, 0.33)).norm(), 0.4e-3) << "row " << k;
  }
}

TEST_P(Recorded, TheEstimatorMakesASmoothBendOfIt) {
  const auto samples = estimates();
  EXPECT_EQ(counters.accepted + counters.not_seen,
            static_cast<std::int64_t>(frames.size()) - counters.repeated);
  EXPECT_EQ(counters.rejected(), counters.not_seen);
  for (std::size_t k = 0; k < samples.size(); ++k) {
    const Sample& s = samples[k];
    if (s.t < 0.45) {
      EXPECT_LT(s.u.norm(), 3e-3) << s.t;
    }
    EXPECT_LT(s.u.norm(), 0.4) << s.t;
    EXPECT_LT(std::abs(s.twist), 0.012) << s.t;
    EXPECT_LT(std::abs(s.length_error), 0.08) << s.t;  // it stretches by a fifth under pressure
    if (k > 0) {
      const double speed = (s.u - samples[k - 1].u).norm() / std::max(0.02, s.t - samples[k - 1].t);
      EXPECT_LT(speed, 2.0) << s.t;  // a column fills at once; times are those of the logging
    }
  }
}

/// Amplitude and phase of a component at 0.1 Hz from 20 s on, by least squares.
std::complex<double> tenth_of_a_hertz(const std::vector<double>& t, const std::vector<double>& x) {
  const double w = 0.2 * std::numbers::pi;
  Eigen::Matrix3d M = Eigen::Matrix3d::Zero();
  Eigen::Vector3d r = Eigen::Vector3d::Zero();
  for (std::size_t k = 0; k < t.size(); ++k) {
    const Eigen::Vector3d b(1.0, std::cos(w * t[k]), std::sin(w * t[k]));
    M += b * b.transpose();
    r += x[k] * b;
  }
  const Eigen::Vector3d c = M.ldlt().solve(r);
  return {c[1], -c[2]};
}

TEST_P(Recorded, TheMotionIsThatOfTheSetPoints) {
  const auto samples = estimates();
  std::vector<double> t, x, y;
  for (const Sample& s : samples) {
    if (s.t < 20.0) continue;
    t.push_back(s.t);
    x.push_back(s.u.x());
    y.push_back(s.u.y());
  }
  const auto a = tenth_of_a_hertz(t, x);
  const auto b = tenth_of_a_hertz(t, y);
  // The ellipse of the motion from its two rotating parts.
  const double left = std::abs(a + std::complex<double>(0, 1) * b) / 2;
  const double right = std::abs(a - std::complex<double>(0, 1) * b) / 2;
  const double long_axis = left + right;
  const double short_axis = std::abs(left - right);
  RecordProperty("long_axis_mrad", std::to_string(1e3 * long_axis));
  RecordProperty("short_axis_mrad", std::to_string(1e3 * short_axis));
  if (std::string(GetParam().map) == "circle_map.yaml") {
    // Four columns a quarter period apart: a round loop.
    EXPECT_GT(short_axis / long_axis, 0.6) << long_axis;
    EXPECT_NEAR(long_axis, 0.042, 0.015);
  } else {
    // One column: back and forth in one plane.
    EXPECT_LT(short_axis / long_axis, 0.1) << long_axis;
    EXPECT_NEAR(long_axis, 0.07, 0.02);
  }
}

INSTANTIATE_TEST_SUITE_P(
    Recordings, Recorded,
    testing::Values(Recording{"four_columns_circle.csv", "circle_map.yaml", 11757, 0.436},
                    Recording{"one_column_sine.csv", "sine_map.yaml", 1323, 0.233}),
    [](const auto& each) { return std::string(each.param.table).substr(0, 3); });

}  // namespace
