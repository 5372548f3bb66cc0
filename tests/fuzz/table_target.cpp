// Tables alone: every export is read as a whole table or refused, and the map that is proposed for
// one is a map that reads it.
#include <algorithm>

#include "fuzz/memory_file.hpp"
#include "fuzz/target.hpp"
#include "softarm/config/config_error.hpp"
#include "softarm/recording/csv_table.hpp"
#include "softarm/recording/map_proposal.hpp"
#include "softarm/recording/recording_map.hpp"

namespace softarm::test {
namespace {

constexpr const char* kMotive =
    "Format Version,1.23,Export Frame Rate,100.0,Rotation Type,Quaternion,Length Units,Meters\n\n"
    ",Type,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid "
    "Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body,Rigid Body\n"
    ",Name,a,a,a,a,a,a,a,b,b,b,b,b,b,b\n,ID,1,1,1,1,1,1,1,2,2,2,2,2,2,2\n"
    ",,Rotation,Rotation,Rotation,Rotation,Position,Position,Position,Rotation,Rotation,Rotation,"
    "Rotation,Position,Position,Position\n"
    "Frame,Time (Seconds),X,Y,Z,W,X,Y,Z,X,Y,Z,W,X,Y,Z\n"
    "0,0.0,0,0,0,1,0,1,0,0,0,0,1,0,0.8,0\n1,0.01,0,0,0,1,0,1,0,,,,,,,\n";
constexpr const char* kVicon =
    "Objects\n100\n,,a:a,,,,,,b:b,,,,,\nFrame,Sub Frame,RX,RY,RZ,TX,TY,TZ,RX,RY,RZ,TX,TY,TZ\n"
    ",,rad,rad,rad,mm,mm,mm,rad,rad,rad,mm,mm,mm\n1,0,0,0,0,0,0,900,0,0.1,0,0,0,700\n"
    "2,0,0,0,0,0,0,900,0,0.2,0,0,0,700\n";
constexpr const char* kQualisys =
    "NO_OF_FRAMES\t2\nFREQUENCY\t100\nBODY_NAMES\ta\tb\n"
    "a X\tY\tZ\tRoll\tPitch\tYaw\tResidual\tRot[0]\tRot[1]\tRot[2]\tRot[3]\tRot[4]\tRot[5]\tRot[6]"
    "\tRot[7]\tRot[8]\tb X\tY\tZ\tRoll\tPitch\tYaw\tResidual\tRot[0]\tRot[1]\tRot[2]\tRot[3]"
    "\tRot[4]\tRot[5]\tRot[6]\tRot[7]\tRot[8]\n"
    "0\t0\t900\t0\t0\t0\t0\t1\t0\t0\t0\t1\t0\t0\t0\t1\t0\t0\t700\t0\t0\t0\t0\t1\t0\t0\t0\t1\t0\t0"
    "\t0\t1\n";
constexpr const char* kPlain =
    "\"t ms\";ax;ay;az;aq;ar;as;at;bx;by;bz;bq;br;bs;bt;p1_set;p1\n"
    "0;0;0;1,5;0;0;0;1;0;0;1,2;0;0;0;1;0;0\n10;0;0;1,5;0;0;0;1;0;0,01;1,2;0;0;0;1;1;0,5\n";

}  // namespace

void run_table(std::span<const std::byte> input) {
  static const MemoryFile table, map;
  table.write(input);
  CsvTable read;
  std::string proposed;
  try {
    read = read_csv(table.path());
    require(read.cells.size() == read.rows() * read.columns.size() && read.rows() > 0,
            "a table has a cell for every row and column");
    require(!read.time_column || *read.time_column < read.columns.size(), "times are in the table");
    for (const TableBody& each : read.bodies)
      require(*std::max_element(each.position.begin(), each.position.end()) < read.columns.size() &&
                  *std::max_element(each.orientation.begin(), each.orientation.end()) <
                      read.columns.size(),
              "a body is in the table");
    proposed = propose_map(read);
  } catch (const BrokenProperty&) {
    throw;
  } catch (const std::runtime_error& error) {
    require(*error.what() != '\0', "an error says what is wrong");
    return;
  }
  map.write(proposed);
  try {
    read_mapped_table(table.path(), map.path());
  } catch (const ConfigError& error) {
    throw BrokenProperty("what is proposed is a map of the table: " + std::string(error.what()));
  }
}

std::vector<Bytes> table_seeds() {
  std::vector<Bytes> seeds;
  for (const char* text : {kMotive, kVicon, kQualisys, kPlain})
    seeds.push_back(to_bytes(std::string(text)));
  return seeds;
}

std::vector<std::string> table_words() {
  return {"nan",
          "inf",
          "1e308",
          "\"",
          "'",
          ",",
          ";",
          "\t",
          "\r",
          "\n",
          "\r\n",
          "#",
          "\xef\xbb\xbf",
          "Rotation",
          "Position",
          "Rot[0]",
          "RX",
          "RW",
          "TX",
          "Frame",
          "Time",
          "x",
          "y",
          "z",
          "w"};
}

}  // namespace softarm::test
