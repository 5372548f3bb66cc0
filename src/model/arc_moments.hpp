#pragma once
#include "model/segment_geometry.hpp"
