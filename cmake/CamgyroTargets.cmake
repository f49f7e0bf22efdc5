# Helpers shared by every folder: one library per folder, one test binary per folder.

# Compiler settings that every target of ours has, and no consumer inherits.
# No -march=native: Debian's Ceres is built without it, and Eigen objects that it allocates would
# be freed with another alignment.
add_library(camgyro_build_flags INTERFACE)
target_compile_options(camgyro_build_flags INTERFACE -Wall -Wextra -Wshadow)
if(CAMGYRO_WERROR)
  # The two exceptions are GCC 12 false alarms inside Eigen 3.4.
  target_compile_options(camgyro_build_flags INTERFACE -Werror -Wno-error=array-bounds
                                                       -Wno-error=maybe-uninitialized)
endif()
if(CAMGYRO_SANITIZE)
  target_compile_options(camgyro_build_flags INTERFACE -fsanitize=${CAMGYRO_SANITIZE}
                         -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(camgyro_build_flags INTERFACE -fsanitize=${CAMGYRO_SANITIZE})
  # As in Debian's Ceres: otherwise Eigen's code allocates differently under AddressSanitizer, and
  # what one of the two allocates the other one cannot free.
  target_compile_definitions(camgyro_build_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()
target_compile_definitions(camgyro_build_flags
                           INTERFACE $<$<CONFIG:Debug>:EIGEN_INITIALIZE_MATRICES_BY_NAN>)

# camgyro_library(NAME SOURCES ... PUBLIC ... PRIVATE ...): library camgyro_NAME, alias camgyro::NAME.
function(camgyro_library name)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "SOURCES;PUBLIC;PRIVATE")
  add_library(camgyro_${name} STATIC ${ARG_SOURCES})
  add_library(camgyro::${name} ALIAS camgyro_${name})
  set_target_properties(camgyro_${name} PROPERTIES EXPORT_NAME ${name} LINKER_LANGUAGE CXX
                                                   POSITION_INDEPENDENT_CODE ON)
  target_compile_features(camgyro_${name} PUBLIC cxx_std_17)
  target_include_directories(camgyro_${name} PUBLIC $<BUILD_INTERFACE:${PROJECT_SOURCE_DIR}>
                                                    $<INSTALL_INTERFACE:include/camgyro>)
  target_link_libraries(camgyro_${name} PUBLIC ${ARG_PUBLIC}
                                        PRIVATE ${ARG_PRIVATE} $<BUILD_INTERFACE:camgyro_build_flags>)
  set_property(GLOBAL APPEND PROPERTY CAMGYRO_LIBRARIES camgyro_${name})
endfunction()

# camgyro_test(FOLDER SOURCES ... DEPS ... SLOW ...): one binary per folder, test_FOLDER with _ for /,
# one ctest entry per test case. SLOW: GoogleTest patterns of those that get the label `slow`, which
# CI's sanitizer run omits.
function(camgyro_test folder)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "SOURCES;DEPS;SLOW")
  string(REPLACE "/" "_" name ${folder})
  set(target test_${name})
  add_executable(${target} $<TARGET_OBJECTS:camgyro_test_main>)
  foreach(source ${ARG_SOURCES})
    target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests/${folder}/${source})
  endforeach()
  target_link_libraries(${target} PRIVATE ${ARG_DEPS} GTest::gmock camgyro_build_flags)
  include(GoogleTest)
  set(how TEST_PREFIX "${name}." DISCOVERY_TIMEOUT 60
          PROPERTIES TIMEOUT 600 ENVIRONMENT "GLOG_minloglevel=2")
  if(ARG_SLOW)
    string(JOIN ":" slow ${ARG_SLOW})
    gtest_discover_tests(${target} TEST_FILTER "-${slow}" ${how})
    gtest_discover_tests(${target} TEST_FILTER "${slow}" ${how} LABELS slow)
  else()
    gtest_discover_tests(${target} ${how})
  endif()
endfunction()
