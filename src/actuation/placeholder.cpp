#include "softarm/actuation/settings.hpp"
