#include "softarm/config/experiment.hpp"
