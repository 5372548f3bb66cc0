#include "softarm/recording/recording_map.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <charconv>

#include "softarm/config/config_keys.hpp"
#include "softarm/model/arm.hpp"
#include "softarm/transport/settings.hpp"

namespace softarm {
namespace {

constexpr auto kRequired = Presence::required;
/// The form of column names. A function, because a map may be read before the variables of this
/// file are initialised.
Form names() { return from(1, 1e5); }

/// The map as it is written in YAML: column names where RecordingMap has indices.
struct NamedBody {
  int id = 0;
  std::string body;
  std::string position, orientation;
  double length_m = 0.0;
};
struct NamedMap {
  std::string separator;
  std::string time;
  NamedBody base;
  std::vector<NamedBody> segments;
  std::string commanded, measured;
  QuaternionOrder order = QuaternionOrder::xyzw;
  std::optional<double> rest_from_s, rest_to_s;
};

void describe_body(Keys& key, NamedBody& it) {
  key("id", it.id, from(0, 1e6), "of the body in our messages", kRequired);
  key("body", it.body, names(), "its name in the table, instead of position and orientation");
  key("position", it.position, names(), "names of the three columns x y z");
  key("orientation", it.orientation, names(), "names of the four columns, in quaternion_order");
}

void describe_table(Keys& key, NamedMap& it, RecordingMap& map) {
  key("separator", it.separator, from(1, 1), "between the cells; left out: the one that is there");
  key("time", it.time, names(),
      "name of the time column; left out: time, or that of a motion-capture export");
  key("equal_times", map.equal_times, one_of({"refuse", "first", "last"}),
      "rows with the time of the row before: refuse, or use the first or the last of them");
  key("time_unit_s", map.time_unit_s, above(0, 1e4), "one unit of time");
  key("position_unit_m", map.position_unit_m, above(0, 1e4), "one unit of position");
  key("up", map.up, one_of({"x", "y", "z"}), "axis of the world that points up");
  key("quaternion_order", it.order, one_of({"xyzw", "wxyz"}), "order of orientation columns");
  key("frame_period_s", map.frame_period_s, above(0, 1e3),
      "whole periods without a frame count as missing frames");
}

void describe_rest(Keys& key, NamedMap& it, RecordingMap& map) {
  key("from_s", it.rest_from_s, Form(), "begin of the window");
  key("to_s", it.rest_to_s, Form(), "end of the window");
  key("base_rotation", map.base_rotation, base_rotation(), "of S_0 in the world (z up)");
}

void describe_pressures(Keys& key, NamedMap& it, RecordingMap& map) {
  key("unit_bar", map.pressure_unit_bar, above(0, 1e4), "one unit of pressure");
  key("missing", map.missing_pressure, one_of({"refuse", "hold"}),
      "a pressure that is no finite number: refuse, or hold that of the row before");
  key("commanded", it.commanded, names(), "names of columns");
  key("measured", it.measured, names(), "names of columns");
}

void describe_channels(Keys& key, RecordingMap& map) {
  key("mocap", map.mocap_channel, from(1, 62), "of frames");
  key("command", map.command_channel, from(1, 62), "of what was commanded");
  key("measurement", map.measurement_channel, from(1, 62), "of what was measured");
}

void describe_map(Keys& key, NamedMap& it, RecordingMap& map) {
  describe_table(key, it, map);
  key.section({"base", "the body at the base of the arm", kRequired},
              [&] { describe_body(key, it.base); });
  key.list({"segments", "the bodies at the segments' ends, from the base on", kRequired},
           it.segments, [&](NamedBody& body) {
             describe_body(key, body);
             key("length_m", body.length_m, above(0, 1e3),
                 "from the body before to this one, at rest", kRequired);
           });
  key.section({"rest", "when the arm is still; its pose then reads straight"},
              [&] { describe_rest(key, it, map); });
  key.section({"pressures", "what was sent to the valves and what their sensors read"},
              [&] { describe_pressures(key, it, map); });
  key.section({"channels", "of the log"}, [&] { describe_channels(key, map); });
}

/// Converts names to columns of the table; reports a name in the map that the table does not have.
class ColumnFinder {
 public:
  ColumnFinder(const ConfigKeys& reader, const CsvTable& table) : reader_(reader), table_(table) {}

  std::vector<std::size_t> find(const std::string& key, const std::string& names,
                                std::size_t count) const {
    std::vector<std::size_t> columns;
    for (const std::string& name : split(names)) columns.push_back(one(key, name));
    if (count != 0 && columns.size() != count) {
      throw reader_.error_at(key, fmt::format("{} names of columns", count),
                             fmt::format("{}", columns.size()));
    }
    return columns;
  }

  std::size_t one(const std::string& key, const std::string& name) const {
    const auto at = std::find(table_.columns.begin(), table_.columns.end(), name);
    if (at != table_.columns.end()) return static_cast<std::size_t>(at - table_.columns.begin());
    std::size_t number = 0;
    const char* const end = name.data() + name.size();
    if (name.starts_with('#') && std::from_chars(name.data() + 1, end, number).ptr == end &&
        number >= 1 && number <= table_.columns.size())
      return number - 1;
    throw reader_.error_at(key, fmt::format("a column of {} ({})", table_.file, some_columns()),
                           name);
  }

  std::size_t time(const std::string& name) const {
    if (name.empty() && table_.time_column) return *table_.time_column;
    return one("time", name.empty() ? "time" : name);
  }

  BodyColumns body(const std::string& key, const NamedBody& named, QuaternionOrder order) const {
    BodyColumns body;
    body.id = named.id;
    body.length_m = named.length_m;
    if (!named.body.empty()) {
      const auto at = std::find_if(table_.bodies.begin(), table_.bodies.end(),
                                   [&](const TableBody& it) { return it.name == named.body; });
      if (at == table_.bodies.end())
        throw reader_.error_at(key + ".body",
                               fmt::format("a body of {} ({})", table_.file, bodies()), named.body);
      body.position = at->position;
      body.orientation = at->orientation;
      return body;
    }
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
  /// Names between blanks; in quotes they may hold some.
  static std::vector<std::string> split(const std::string& text) {
    std::vector<std::string> names;
    for (std::size_t at = text.find_first_not_of(' '); at < text.size();
         at = text.find_first_not_of(' ', at)) {
      const bool quoted = text[at] == '\'' || text[at] == '"';
      const std::size_t begin = at + (quoted ? 1 : 0);
      const std::size_t end = std::min(text.find(quoted ? text[at] : ' ', begin), text.size());
      names.push_back(text.substr(begin, end - begin));
      at = end + (quoted ? 1 : 0);
    }
    return names;
  }
  std::string some_columns() const {
    constexpr std::size_t kSome = 12;
    const std::size_t count = std::min(table_.columns.size(), kSome);
    return fmt::format("{}{}",
                       fmt::join(table_.columns.begin(),
                                 table_.columns.begin() + static_cast<std::ptrdiff_t>(count), ", "),
                       count < table_.columns.size() ? ", ..." : "");
  }
  std::string bodies() const {
    std::vector<std::string> names;
    for (const TableBody& each : table_.bodies) names.push_back(each.name);
    return names.empty() ? "it names none" : fmt::format("{}", fmt::join(names, ", "));
  }

  const ConfigKeys& reader_;
  const CsvTable& table_;
};

void check(const ConfigKeys& reader, const NamedMap& named, RecordingMap& map) {
  if (named.segments.size() > static_cast<std::size_t>(kMaxSegments)) {
    throw reader.error_at("segments", fmt::format("at most {}", kMaxSegments),
                          fmt::format("{}", named.segments.size()));
  }
  const auto whole = [&](const NamedBody& body, const std::string& key) {
    const bool columns = !body.position.empty() && !body.orientation.empty();
    if (body.body.empty() ? columns : body.position.empty() && body.orientation.empty()) return;
    throw reader.error_at(key, "either body, or position and orientation",
                          body.body.empty() ? "one of them, or none" : "both");
  };
  whole(named.base, "base");
  for (std::size_t i = 0; i < named.segments.size(); ++i)
    whole(named.segments[i], fmt::format("segments[{}]", i));
  std::vector<int> ids{named.base.id};
  for (std::size_t i = 0; i < named.segments.size(); ++i) {
    const int id = named.segments[i].id;
    if (std::find(ids.begin(), ids.end(), id) != ids.end()) {
      throw reader.error_at(fmt::format("segments[{}].id", i), "a distinct id",
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
    throw reader.error_at("rest.base_rotation", "a rotation", "a matrix that is not a rotation");
  }
}

}  // namespace

MappedTable read_mapped_table(const std::filesystem::path& table,
                              const std::filesystem::path& map) {
  ConfigKeys keys(map);
  NamedMap named;
  MappedTable out;
  const LcmSettings channels;
  out.map.mocap_channel = channels.mocap_channel;
  out.map.command_channel = channels.command_channel;
  out.map.measurement_channel = channels.measurement_channel;
  keys.visit([&] { describe_map(keys, named, out.map); });
  check(keys, named, out.map);

  out.files = keys.files();
  out.files.push_back(table);
  out.table = read_csv(
      table, named.separator.empty() ? std::nullopt : std::optional(named.separator.front()));
  const ColumnFinder finder(keys, out.table);
  out.map.time_column = finder.time(named.time);
  if (!keys.given("position_unit_m") && out.table.position_unit_m > 0.0)
    out.map.position_unit_m = out.table.position_unit_m;
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
