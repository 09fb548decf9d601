# SPDX-License-Identifier: MIT
# Debian's liblcm-dev ships neither a CMake package nor a usable pkg-config file.
# Defines LCM::lcm, LCM_GEN and lcm_generate_c(TARGET file.lcm ...): a static library of the C types, and TARGET.h, which
# includes them all and lists them: TARGET_LIST(X) is X(type) for each, TARGET_COUNT how many there are.
find_path(LCM_INCLUDE_DIR lcm/lcm.h)
find_library(LCM_LIBRARY lcm)
find_program(LCM_GEN lcm-gen)
include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(LCM REQUIRED_VARS LCM_LIBRARY LCM_INCLUDE_DIR LCM_GEN)

if(LCM_FOUND AND NOT TARGET LCM::lcm)
    add_library(LCM::lcm UNKNOWN IMPORTED)
    set_target_properties(LCM::lcm PROPERTIES IMPORTED_LOCATION ${LCM_LIBRARY}
                          INTERFACE_INCLUDE_DIRECTORIES ${LCM_INCLUDE_DIR})
endif()

function(lcm_generate_c target)
    set(out ${CMAKE_CURRENT_BINARY_DIR}/generated)
    file(MAKE_DIRECTORY ${out}) # lcm-gen exits 0 without writing when the folder is missing
    set(sources "")
    set(headers "")
    set(list "")
    foreach(type ${ARGN})
        file(STRINGS ${type} package REGEX "^package ")
        string(REGEX REPLACE "^package +([a-z0-9_]+).*" "\\1" package "${package}")
        get_filename_component(name ${type} NAME_WE)
        set(name ${package}_${name})
        add_custom_command(
            OUTPUT ${out}/${name}.c ${out}/${name}.h
            COMMAND ${LCM_GEN} -c --c-cpath ${out} --c-hpath ${out} ${CMAKE_CURRENT_SOURCE_DIR}/${type}
            DEPENDS ${type} VERBATIM)
        list(APPEND sources ${out}/${name}.c)
        string(APPEND headers "#include \"${name}.h\"\n")
        string(APPEND list " X(${name})")
    endforeach()
    string(TOUPPER ${target} upper)
    list(LENGTH ARGN count)
    file(CONFIGURE OUTPUT ${out}/${target}.h
         CONTENT "${headers}#define ${upper}_LIST(X)${list}\n#define ${upper}_COUNT ${count}\n" @ONLY)
    add_library(${target} STATIC ${sources})
    target_include_directories(${target} SYSTEM PUBLIC ${out})
    target_link_libraries(${target} PUBLIC LCM::lcm)
    # Generated code: no warnings of ours; gcc 12 at -O3 makes its float encoding four times slower; its
    # decoders pass null to memcpy for empty arrays.
    target_compile_options(${target} PRIVATE -w -O2 -fno-strict-aliasing
                           -fno-sanitize=nonnull-attribute)
endfunction()
