# SPDX-License-Identifier: MIT
# Libraries that only files of some formats need are loaded with the first such file: most of what the smallest
# scene held in memory were HDF5, teem and what these are linked with.

# Writes on_demand/<name>.h, which includes the header of the library and replaces each symbol (a function or a
# variable) by an entry of a table, and on_demand/<name>.c with that table and <name>_library, a Library of
# base/library.h, which fills it. The linker complains of symbols that are used and not listed.
# pliant_on_demand(name library header symbols...), for the module io.
function(pliant_on_demand name library header)
    if(TARGET ${library})
        get_target_property(library ${library} LOCATION)
    endif()
    execute_process(COMMAND ${CMAKE_OBJDUMP} -p ${library} OUTPUT_VARIABLE found ERROR_QUIET)
    if(NOT found MATCHES "SONAME +([^ \n]+)")
        message(FATAL_ERROR "${library} is no shared library, which programs could load when they need it")
    endif()
    set(soname ${CMAKE_MATCH_1})
    set_property(GLOBAL PROPERTY PLIANT_SONAME_${name} ${soname})
    list(LENGTH ARGN count)
    list(JOIN ARGN "\", \"" names)
    set(macros "")
    set(i 0)
    foreach(symbol ${ARGN})
        string(APPEND macros "#define ${symbol} (*(__typeof__(&${symbol}))${name}_symbol[${i}])\n")
        math(EXPR i "${i} + 1")
    endforeach()
    set(folder ${CMAKE_BINARY_DIR}/modules/on_demand)
    file(CONFIGURE OUTPUT ${folder}/on_demand/${name}.h @ONLY CONTENT
"// Written by server/on_demand.cmake.
#ifndef PLIANT_ON_DEMAND_${name}
#define PLIANT_ON_DEMAND_${name}

#include \"base/library.h\"

#include <${header}>

extern Library ${name}_library;
extern uintptr_t ${name}_symbol[${count}];
${macros}
#endif
")
    file(CONFIGURE OUTPUT ${folder}/on_demand/${name}.c @ONLY CONTENT
"// Written by server/on_demand.cmake.
#include \"on_demand/${name}.h\"

uintptr_t ${name}_symbol[${count}];
static const char *const names[] = {\"${names}\"};
Library ${name}_library = {\"${soname}\", names, ${name}_symbol, ${count}, false};
")
    target_sources(pliant_io PRIVATE ${folder}/on_demand/${name}.c)
    target_include_directories(pliant_io PRIVATE ${folder})
    # The dynamic linker looks in the system's folders, and where it is told to.
    get_filename_component(library ${library} REALPATH)
    get_filename_component(folder ${library} DIRECTORY)
    if(NOT folder IN_LIST CMAKE_C_IMPLICIT_LINK_DIRECTORIES)
        target_link_options(pliant_io INTERFACE -Wl,-rpath,${folder})
    endif()
    set_property(GLOBAL APPEND PROPERTY PLIANT_ON_DEMAND ${library})
endfunction()
