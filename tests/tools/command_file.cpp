#include "run.h"

namespace dyntape::test {

std::string command_file() { return DYNTAPE_COMMAND; }

}  // namespace dyntape::test
