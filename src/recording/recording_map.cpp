#include "softarm/recording/recording_map.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <sstream>

#include "config/reader.hpp"
#include "config/yaml_tree.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr auto kRequired = Presence::required;
constexpr Range kText = {1.0, 2000.0};

/// The map as it is written: names where RecordingMap has columns.
struct NamedBody {
  int id = 0;
  std::string position, orientation;
  double length_m = 0.0;
};
struct NamedMap {
  std::string separator = ",";
  std::string time = "time";
  NamedBody base;
  std::vector<NamedBody> segments;
  std::string commanded, measured;
  QuaternionOrder order = QuaternionOrder::xyzw;
  std::optional<double> rest_from_s, rest_to_s;
};

void describe_body(SchemaVisitor& visitor, NamedBody& body) {
  visitor.integer({"id", "", "of the body in our messages", from_to(0, 1e6), kRequired}, body.id);
  visitor.text({"position", "", "names of the three columns x y z", kText, kRequired},
               body.position);
  visitor.text(
      {"orientation", "", "names of the four columns, in quaternion_order", kText, kRequired},
      body.orientation);
}

void describe_table(SchemaVisitor& visitor, NamedMap& named, RecordingMap& map) {
  static const std::array<const char*, 3> kUp = {"x", "y", "z"};
  static const std::array<const char*, 2> kOrder = {"xyzw", "wxyz"};
  visitor.text({"separator", "", "between the cells", from_to(1, 1)}, named.separator);
  visitor.text({"time", "", "name of the time column", kText}, named.time);
  visitor.number({"time_unit_s", "s", "one unit of time", above_to(0, 1e4)}, map.time_unit_s);
  visitor.number({"position_unit_m", "m", "one unit of position", above_to(0, 1e4)},
                 map.position_unit_m);
  visitor.choice({"up", "", "axis of the world that points up"}, kUp, map.up);
  visitor.choice({"quaternion_order", "", "order of orientation columns"}, kOrder, named.order);
  visitor.optional_number(
      {"frame_period_s", "s", "whole periods without a frame count as missing frames",
       above_to(0, 1e3)},
      map.frame_period_s);
}

void describe_bodies(SchemaVisitor& visitor, NamedMap& named) {
  visitor.section({"base", "", "the body at the base of the arm", {}, kRequired},
                  SectionKind::plain, [&] { describe_body(visitor, named.base); });
  visitor.list(
      {"segments", "", "the bodies at the segments' ends, from the base on", {}, kRequired},
      static_cast<int>(named.segments.size()),
      [&](int size) { named.segments.resize(static_cast<std::size_t>(size)); },
      [&](int i) {
        NamedBody& body = named.segments[static_cast<std::size_t>(i)];
        describe_body(visitor, body);
        visitor.number({"length_m", "m", "from the body before to this one, at rest",
                        above_to(0, 1e3), kRequired},
                       body.length_m);
      });
}

void describe_rest(SchemaVisitor& visitor, NamedMap& named, RecordingMap& map) {
  static const std::array<const char*, 2> kNames = {"hanging", "standing"};
  static const std::array<Eigen::Matrix3d, 2> kRotations = {
      Eigen::Matrix3d(Eigen::Vector3d(1.0, -1.0, -1.0).asDiagonal()), Eigen::Matrix3d::Identity()};
  visitor.section(
      {"rest", "", "when the arm is still; its pose then reads straight"}, SectionKind::plain, [&] {
        visitor.optional_number({"from_s", "s", "begin of the window"}, named.rest_from_s);
        visitor.optional_number({"to_s", "s", "end of the window"}, named.rest_to_s);
        visitor.matrix_or_word({"base_rotation", "", "of S_0 in the world (z up)", from_to(-1, 1)},
                               kNames, kRotations, map.base_rotation);
      });
}

void describe_outputs(SchemaVisitor& visitor, NamedMap& named, RecordingMap& map) {
  visitor.section({"pressures", "", "what was sent to the valves and what their sensors read"},
                  SectionKind::plain, [&] {
                    visitor.number({"unit_bar", "bar", "one unit of pressure", above_to(0, 1e4)},
                                   map.pressure_unit_bar);
                    visitor.text({"commanded", "", "names of columns", kText}, named.commanded);
                    visitor.text({"measured", "", "names of columns", kText}, named.measured);
                  });
  visitor.section({"channels", "", "of the log"}, SectionKind::plain, [&] {
    visitor.text({"mocap", "", "", from_to(1, 62)}, map.mocap_channel);
    visitor.text({"command", "", "", from_to(1, 62)}, map.command_channel);
    visitor.text({"measurement", "", "", from_to(1, 62)}, map.measurement_channel);
  });
}

/// Turns names into columns of the table, or says which name of the map is not there.
class ColumnFinder {
 public:
  ColumnFinder(const ExperimentReader& reader, const CsvTable& table)
      : reader_(reader), table_(table) {}

  std::vector<std::size_t> find(const std::string& key, const std::string& names,
                                std::size_t count) const {
    std::vector<std::size_t> columns;
    std::istringstream stream(names);
    for (std::string name; stream >> name;) columns.push_back(one(key, name));
    if (count != 0 && columns.size() != count) {
      throw reader_.error_at(key, fmt::format("{} names of columns", count),
                             fmt::format("{}", columns.size()));
    }
    return columns;
  }

  std::size_t one(const std::string& key, const std::string& name) const {
    const auto at = std::find(table_.columns.begin(), table_.columns.end(), name);
    if (at == table_.columns.end()) {
      throw reader_.error_at(key, fmt::format("a column of {}", table_.file), name);
    }
    return static_cast<std::size_t>(at - table_.columns.begin());
  }

  BodyColumns body(const std::string& key, const NamedBody& named, QuaternionOrder order) const {
    BodyColumns body;
    body.id = named.id;
    body.length_m = named.length_m;
    const auto position = find(key + ".position", named.position, 3);
    auto orientation = find(key + ".orientation", named.orientation, 4);
    if (order == QuaternionOrder::wxyz) {
      std::rotate(orientation.begin(), orientation.begin() + 1, orientation.end());
    }
    std::copy(position.begin(), position.end(), body.position.begin());
    std::copy(orientation.begin(), orientation.end(), body.orientation.begin());
    return body;
  }

 private:
  const ExperimentReader& reader_;
  const CsvTable& table_;
};

void check(const ExperimentReader& reader, const NamedMap& named, RecordingMap& map) {
  if (named.segments.size() > static_cast<std::size_t>(kMaxSegments)) {
    throw reader.error_at("segments", fmt::format("at most {}", kMaxSegments),
                          fmt::format("{}", named.segments.size()));
  }
  std::vector<int> ids{named.base.id};
  for (std::size_t i = 0; i < named.segments.size(); ++i) {
    const int id = named.segments[i].id;
    if (std::find(ids.begin(), ids.end(), id) != ids.end()) {
      throw reader.error_at(fmt::format("segments[{}].id", i), "an id of its own",
                            fmt::format("{} again", id));
    }
    ids.push_back(id);
  }
  if (named.rest_from_s.has_value() != named.rest_to_s.has_value()) {
    throw reader.error_at("rest", "both from_s and to_s", "one of them");
  }
  if (named.rest_from_s) {
    if (!(*named.rest_to_s > *named.rest_from_s)) {
      throw reader.error_at("rest.to_s",
                            fmt::format("a time after from_s ({})", *named.rest_from_s),
                            fmt::format("{}", *named.rest_to_s));
    }
    map.rest = RestWindow{*named.rest_from_s, *named.rest_to_s};
  }
  const Eigen::Matrix3d& R = map.base_rotation;
  if (!(R * R.transpose()).isIdentity(1e-6) || R.determinant() < 0.0) {
    throw reader.error_at("rest.base_rotation", "a rotation", "a matrix that is none");
  }
}

}  // namespace

MappedTable read_mapped_table(const std::filesystem::path& table,
                              const std::filesystem::path& map) {
  const YamlNode root = read_yaml_file(map);
  ExperimentReader reader(root);
  NamedMap named;
  MappedTable out;
  const LcmSettings channels;
  out.map.mocap_channel = channels.mocap_channel;
  out.map.command_channel = channels.command_channel;
  out.map.measurement_channel = channels.measurement_channel;
  reader.read([&] {
    describe_table(reader, named, out.map);
    describe_bodies(reader, named);
    describe_rest(reader, named, out.map);
    describe_outputs(reader, named, out.map);
  });
  check(reader, named, out.map);

  out.table = read_csv(table, named.separator.front());
  const ColumnFinder finder(reader, out.table);
  out.map.time_column = finder.one("time", named.time);
  out.map.bodies.push_back(finder.body("base", named.base, named.order));
  for (std::size_t i = 0; i < named.segments.size(); ++i) {
    out.map.bodies.push_back(
        finder.body(fmt::format("segments[{}]", i), named.segments[i], named.order));
  }
  out.map.commanded = finder.find("pressures.commanded", named.commanded, 0);
  out.map.measured = finder.find("pressures.measured", named.measured, 0);
  return out;
}

}  // namespace softarm
