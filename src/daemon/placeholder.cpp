#include "softarm/daemon/settings.hpp"
