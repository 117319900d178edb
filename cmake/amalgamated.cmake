# The library as one file, for the C tests: `tested` is then compiled from kreisel.c, without the options of CMakeLists.txt,
# because its users compile it without them.
find_package(Python3 3.11 REQUIRED COMPONENTS Interpreter)
set(folder ${PROJECT_BINARY_DIR}/amalgamation)
file(GLOB_RECURSE parts CONFIGURE_DEPENDS csrc/*)
add_custom_command(OUTPUT ${folder}/kreisel.c
  COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/cmake/amalgamate.py ${folder}
  DEPENDS ${parts} cmake/amalgamate.py CMakeLists.txt LICENSE VERBATIM)
set(tested kreisel_amalgamated)
add_library(${tested} STATIC ${folder}/kreisel.c)
set_target_properties(${tested} PROPERTIES COMPILE_OPTIONS "-O2;-Wall;-Wextra;-Wpedantic;-Werror")
target_include_directories(${tested} INTERFACE csrc)
set_target_properties(kreisel_objects kreisel kreisel_static PROPERTIES EXCLUDE_FROM_ALL ON)
foreach(isa ${further_isas})
  set_target_properties(kreisel_${isa} PROPERTIES EXCLUDE_FROM_ALL ON)
endforeach()
