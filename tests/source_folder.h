// Where the sources lie.  One unit alone knows it (source_folder.cpp): the objects of all others are the same in every
// clone, and a compiler cache has them already.
#pragma once

#include <string>

namespace dyntape::test {

std::string source_folder();

}  // namespace dyntape::test
