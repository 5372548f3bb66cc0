#include "softarm/model/arm.hpp"
