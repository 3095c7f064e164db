# Writes a header with what the generator must know about itself: the text of its C interface, and a
# fingerprint of everything that decides what it prints, so that a library of another generator is never used.
#   cmake -DOUTPUT=embedded.h -DABI=abi.h -DVERSION=0.1.0 "-DSOURCES=a.cpp;b.cpp" -P embed.cmake
file(READ ${ABI} abi)
string(REGEX REPLACE "^.*/\\* --- begin of the interface --- \\*/\n" "" abi "${abi}")
string(REGEX REPLACE "/\\* --- end of the interface --- \\*/.*$" "" abi "${abi}")
set(digests "")
foreach(source IN LISTS SOURCES)
  file(SHA256 ${source} digest)
  string(APPEND digests ${digest})
endforeach()
string(SHA256 fingerprint "${digests}")
file(WRITE ${OUTPUT} "inline constexpr char kVersion[] = \"${VERSION}\";
inline constexpr char kFingerprint[] = \"${fingerprint}\";
inline constexpr char kAbiText[] = R\"abi(${abi})abi\";
")
