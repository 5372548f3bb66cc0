// Another project's program: the model of an arm, through the installed headers and libraries only.
#include <cstdio>
#include <softarm/control/settings.hpp>
#include <softarm/model/arm.hpp>

int main() {
  softarm::ArmParameters arm;
  arm.segments.resize(3);
  std::printf("%d segments, %d degrees of freedom\n", arm.size(), arm.dof());
  return arm.dof() == 6 ? 0 : 1;
}
