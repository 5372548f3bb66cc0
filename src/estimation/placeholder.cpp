#include "softarm/estimation/settings.hpp"
