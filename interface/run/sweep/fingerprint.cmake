# Writes a source with a checksum of all sources that decide what a sweep's rows are.
#   cmake -DOUTPUT=program_fingerprint.cpp -DVERSION=0.1.0 "-DSOURCES=a.cpp;b.cpp" -P fingerprint.cmake
set(digests "")
foreach(source IN LISTS SOURCES)
  file(SHA256 ${source} digest)
  string(APPEND digests ${digest})
endforeach()
string(SHA256 fingerprint "${digests}")
file(WRITE ${OUTPUT} "#include <dyntape/interface/run/sweep/sweep_folder.h>

namespace dyntape {
const char* program_fingerprint() { return \"${VERSION} ${fingerprint}\"; }
}  // namespace dyntape
")
