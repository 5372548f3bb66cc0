#include "softarm/control/settings.hpp"
