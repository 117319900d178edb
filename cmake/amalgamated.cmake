# The library as one file, for the C tests: `tested` is then compiled from kreisel.c, without the options of CMakeLists.txt,
# because its users compile it without them. The command is that of docs/embedding.md, so that ccache compiles it once.
find_package(Python3 3.11 REQUIRED COMPONENTS Interpreter)
set(folder ${PROJECT_BINARY_DIR}/amalgamation)
file(GLOB_RECURSE parts CONFIGURE_DEPENDS csrc/*)
add_custom_command(OUTPUT ${folder}/kreisel.c
  COMMAND Python3::Interpreter ${PROJECT_SOURCE_DIR}/cmake/amalgamate.py ${folder}
  DEPENDS ${parts} cmake/amalgamate.py CMakeLists.txt LICENSE VERBATIM)
add_custom_command(OUTPUT ${folder}/kreisel.o
  COMMAND ${CMAKE_C_COMPILER_LAUNCHER} ${CMAKE_C_COMPILER} -O2 -std=c99 -c kreisel.c
  DEPENDS ${folder}/kreisel.c WORKING_DIRECTORY ${folder} VERBATIM)
set(tested kreisel_amalgamated)
add_library(${tested} STATIC ${folder}/kreisel.o)
set_target_properties(${tested} PROPERTIES LINKER_LANGUAGE C)
target_include_directories(${tested} INTERFACE csrc)
set_target_properties(kreisel_objects kreisel kreisel_static PROPERTIES EXCLUDE_FROM_ALL ON)
foreach(isa ${further_isas})
  set_target_properties(kreisel_${isa} PROPERTIES EXCLUDE_FROM_ALL ON)
endforeach()
