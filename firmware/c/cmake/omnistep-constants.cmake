# omnistep_constants(TARGET SCENARIO [KEY=VALUE...]): constants.h for TARGET, written by `omnistep export` from a scenario
# file (or a built-in scenario), with keys replaced as by --set. Looked at in every build, because a scenario names other files;
# where the numbers are the same, nothing is compiled anew.
function(omnistep_constants target scenario)
    find_program(OMNISTEP_COMMAND omnistep)
    if(NOT OMNISTEP_COMMAND)
        message(FATAL_ERROR "omnistep_constants(${target}): no command omnistep on the PATH; give it with -DOMNISTEP_COMMAND=/its/path")
    endif()
    set(folder "${CMAKE_CURRENT_BINARY_DIR}/${target}_constants")
    add_custom_target(${target}_constants
        COMMAND "${CMAKE_COMMAND}" "-DCOMMAND=${OMNISTEP_COMMAND}" "-DSCENARIO=${scenario}" "-DKEYS=${ARGN}"
            "-DHEADER=${folder}/constants.h" -P "${CMAKE_CURRENT_FUNCTION_LIST_DIR}/write-constants.cmake"
        WORKING_DIRECTORY "${CMAKE_CURRENT_SOURCE_DIR}"
        BYPRODUCTS "${folder}/constants.h"
        COMMENT "constants of ${scenario}"
        VERBATIM)
    add_dependencies(${target} ${target}_constants)
    target_include_directories(${target} PRIVATE "${folder}")
endfunction()
