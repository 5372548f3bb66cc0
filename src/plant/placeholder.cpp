#include "softarm/plant/settings.hpp"
