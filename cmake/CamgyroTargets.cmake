# Helpers shared by every folder: one library per folder, one test binary per folder.

# Compiler settings that every target of ours has, and no consumer inherits.
# No -march=native: Debian's Ceres is built without it, and Eigen objects that it allocates would
# be freed with another alignment.
add_library(camgyro_build_flags INTERFACE)
target_compile_options(camgyro_build_flags INTERFACE -Wall -Wextra -Wshadow)
if(CAMGYRO_WERROR)
  # The two exceptions are GCC 12 false alarms inside Eigen 3.4.
  target_compile_options(camgyro_build_flags INTERFACE -Werror
    $<$<CXX_COMPILER_ID:GNU>:-Wno-error=array-bounds -Wno-error=maybe-uninitialized>)
endif()
if(CAMGYRO_SANITIZE)
  # Without the checks at each use of a pointer, of which Eigen is full: they were a third of the
  # time of compiling. AddressSanitizer sees a null pointer that is used, too; nothing here casts
  # bytes to wider types or down a class hierarchy.
  target_compile_options(camgyro_build_flags INTERFACE -fsanitize=${CAMGYRO_SANITIZE}
                         -fno-sanitize=null,alignment,object-size,vptr,pointer-overflow
                         -fno-omit-frame-pointer -fno-sanitize-recover=all)
  target_link_options(camgyro_build_flags INTERFACE -fsanitize=${CAMGYRO_SANITIZE})
  # As in Debian's Ceres: otherwise Eigen's code allocates differently under AddressSanitizer, and
  # what one of the two allocates the other one cannot free.
  target_compile_definitions(camgyro_build_flags INTERFACE EIGEN_MALLOC_ALREADY_ALIGNED=1)
endif()
target_compile_definitions(camgyro_build_flags
                           INTERFACE $<$<CONFIG:Debug>:EIGEN_INITIALIZE_MATRICES_BY_NAN>)

# camgyro_fuzzed(TARGET): the fuzzer sees which code of it an input reaches (CAMGYRO_FUZZ).
function(camgyro_fuzzed target)
  if(CAMGYRO_FUZZ)
    target_compile_options(${target} PRIVATE -fsanitize=fuzzer-no-link)
  endif()
endfunction()

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

# camgyro_test(FOLDER SOURCES ... DEPS ... SLOW ... LONG ...): one binary per folder, test_FOLDER with
# _ for /, one ctest entry per GoogleTest suite. SLOW: GoogleTest patterns of the tests that go into
# entries of their own, with the label `slow`, which CI's sanitizer run omits. LONG: the same, with the
# label `long` besides, which CI omits altogether; of simulated recordings only, and where other tests
# run the same code.
function(camgyro_test folder)
  cmake_parse_arguments(PARSE_ARGV 1 ARG "" "" "SOURCES;DEPS;SLOW;LONG")
  string(REPLACE "/" "_" name ${folder})
  set(target test_${name})
  add_executable(${target} $<TARGET_OBJECTS:camgyro_test_main>)
  foreach(source ${ARG_SOURCES})
    target_sources(${target} PRIVATE ${PROJECT_SOURCE_DIR}/tests/${folder}/${source})
  endforeach()
  target_link_libraries(${target} PRIVATE ${ARG_DEPS} GTest::gmock camgyro_build_flags)
  # What is tested are the libraries, which keep their optimisation; the tests' own code is to compile
  # quickly: -O1 with GCC, which gains nothing by -O0; with clang and sanitizers -O0 takes under half.
  target_compile_options(${target} PRIVATE $<$<CONFIG:Release>:-O1> $<$<CONFIG:Debug>:-O0>)
  string(JOIN ":" slow ${ARG_SLOW})
  string(JOIN ":" long ${ARG_LONG})
  set(entries ${CMAKE_CURRENT_BINARY_DIR}/${target}_entries.cmake)
  add_custom_command(TARGET ${target} POST_BUILD VERBATIM
    COMMAND ${CMAKE_COMMAND} -DBINARY=$<TARGET_FILE:${target}> -DPREFIX=${name} "-DSLOW=${slow}"
            "-DLONG=${long}" -DOUTPUT=${entries} -P ${PROJECT_SOURCE_DIR}/cmake/CamgyroDiscoverSuites.cmake)
  # Until it is built, ctest has one entry for it, which fails.
  file(CONFIGURE OUTPUT ${target}_include.cmake @ONLY CONTENT
       "if(EXISTS [==[@entries@]==])\n  include([==[@entries@]==])\nelse()\n  add_test(@name@.NOT_BUILT @target@)\nendif()\n")
  set_property(DIRECTORY APPEND PROPERTY TEST_INCLUDE_FILES
               ${CMAKE_CURRENT_BINARY_DIR}/${target}_include.cmake)
endfunction()
