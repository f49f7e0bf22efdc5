# Run after a test binary is linked: writes the ctest entries of BINARY to OUTPUT, one per GoogleTest
# suite, named PREFIX.SUITE, and one for each of the patterns SLOW and LONG, which are joined by `:`,
# with the labels `slow`, and `slow` and `long`. Each test is in one entry: what is in LONG is not in
# SLOW, and neither is in the suites.
#
# Not one entry per test, as gtest_discover_tests makes them: each entry is a process, and OpenCV's
# libraries alone take 0.1 s to load, with sanitizers 0.3 s (`time test_tools --gtest_list_tests`).
cmake_minimum_required(VERSION 3.21)

function(list_suites filter out)
  execute_process(COMMAND ${BINARY} --gtest_list_tests "--gtest_filter=${filter}"
                  OUTPUT_VARIABLE listed RESULT_VARIABLE failed)
  if(failed)
    message(FATAL_ERROR "${BINARY} --gtest_list_tests: ${failed}")
  endif()
  string(REGEX MATCHALL "(^|\n)[A-Za-z0-9_/]+\\." suites "${listed}")
  list(TRANSFORM suites REPLACE "[\n.]" "")
  set(${out} ${suites} PARENT_SCOPE)
endfunction()

set(script "")
function(add_entry name filter properties)
  string(APPEND script
    "add_test([==[${name}]==] [==[${BINARY}]==] [==[--gtest_filter=${filter}]==] --gtest_brief=1)\n"
    "set_tests_properties([==[${name}]==] PROPERTIES TIMEOUT 1500 ENVIRONMENT GLOG_minloglevel=2"
    " ${properties})\n")
  set(script "${script}" PARENT_SCOPE)
endfunction()

set(but_slow "")
if(SLOW OR LONG)
  string(JOIN ":" but_slow ${SLOW} ${LONG})
  set(but_slow "-${but_slow}")
endif()
list_suites("*${but_slow}" suites)
foreach(suite ${suites})
  add_entry("${PREFIX}.${suite}" "${suite}.*${but_slow}" "")
endforeach()
string(REPLACE ":" ";" slow "${SLOW}")
string(REPLACE ":" ";" long "${LONG}")
foreach(pattern ${slow} ${long})
  set(filter "${pattern}")
  set(labels [==["slow;long"]==])
  if(NOT pattern IN_LIST long)
    set(labels slow)
    if(LONG)
      string(APPEND filter "-${LONG}")
    endif()
  endif()
  list_suites("${filter}" suites)
  if(NOT suites)
    message(FATAL_ERROR "tests/CMakeLists.txt: SLOW or LONG of ${PREFIX}: no test matches ${pattern}")
  endif()
  # The longest first, so that no core is idle at the end.
  string(REGEX REPLACE "[*]|[.][*]$" "" named "${pattern}")
  add_entry("${PREFIX}.${named}" "${filter}" "LABELS ${labels} COST 100")
endforeach()
file(WRITE ${OUTPUT} "${script}")
