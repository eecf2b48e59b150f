# What omnistep_constants does in a build: COMMAND writes the constants of SCENARIO with KEYS, which become HEADER where they
# differ. What is wrong with a file the command says by itself.
# A header of that name beside the sources would be found before the one that is written here.
if(EXISTS "${CMAKE_CURRENT_SOURCE_DIR}/constants.h")
    message(FATAL_ERROR "${CMAKE_CURRENT_SOURCE_DIR}/constants.h would be used instead of the constants of ${SCENARIO}: remove it")
endif()
list(TRANSFORM KEYS PREPEND "--set;" OUTPUT_VARIABLE options)
execute_process(COMMAND "${COMMAND}" export "${SCENARIO}" ${options} --format c OUTPUT_VARIABLE constants RESULT_VARIABLE code)
if(NOT code EQUAL 0)
    message(FATAL_ERROR "no constants of ${SCENARIO}: the line above says why (${COMMAND})")
endif()
file(CONFIGURE OUTPUT "${HEADER}" CONTENT "${constants}" @ONLY)
