# Debian's librosbag-storage-dev and libsensor-msgs-dev: target Rosbag::storage. By hand, since
# rosbag_storage.pc asks for a pluginlib.pc that Debian 12 does not have, and its pluginlib, from
# ROS 2, keeps headers in folders of their own.
find_path(RosbagStorage_INCLUDE_DIR rosbag/bag.h)
find_path(RosbagStorage_MESSAGES_INCLUDE_DIR sensor_msgs/Imu.h)
set(RosbagStorage_includes RosbagStorage_INCLUDE_DIR RosbagStorage_MESSAGES_INCLUDE_DIR)
foreach(header pluginlib/class_loader class_loader/multi_library_class_loader rcutils/get_env
        rcpputils/shared_library ament_index_cpp/get_resource)
  get_filename_component(package ${header} DIRECTORY)
  find_path(RosbagStorage_${package}_INCLUDE_DIR NAMES ${header}.hpp ${header}.h
            PATH_SUFFIXES ${package})
  list(APPEND RosbagStorage_includes RosbagStorage_${package}_INCLUDE_DIR)
endforeach()
set(RosbagStorage_libraries)
foreach(library rosbag_storage roscpp_serialization rostime cpp_common console_bridge)
  find_library(RosbagStorage_${library}_LIBRARY ${library})
  list(APPEND RosbagStorage_libraries RosbagStorage_${library}_LIBRARY)
endforeach()

include(FindPackageHandleStandardArgs)
find_package_handle_standard_args(
  RosbagStorage REQUIRED_VARS ${RosbagStorage_libraries} ${RosbagStorage_includes})
if(RosbagStorage_FOUND AND NOT TARGET Rosbag::storage)
  add_library(Rosbag::storage INTERFACE IMPORTED)
  foreach(variable ${RosbagStorage_includes})
    set_property(TARGET Rosbag::storage APPEND PROPERTY
                 INTERFACE_INCLUDE_DIRECTORIES ${${variable}})
  endforeach()
  foreach(variable ${RosbagStorage_libraries})
    set_property(TARGET Rosbag::storage APPEND PROPERTY INTERFACE_LINK_LIBRARIES ${${variable}})
  endforeach()
endif()
