#include "source_folder.h"

namespace dyntape::test {

std::string source_folder() { return DYNTAPE_SOURCE_DIR; }

}  // namespace dyntape::test
