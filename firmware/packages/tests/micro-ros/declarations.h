/* What node.c uses of rclc, rmw_microros and the messages: declarations for a compiler, made for the test. */
#ifndef DECLARATIONS_H
#define DECLARATIONS_H
#include <stddef.h>
#include <stdint.h>

enum { RCL_RET_OK = 0, RMW_RET_OK = 0 };
#define RCL_MS_TO_NS(milliseconds) ((milliseconds)*1000000LL)
typedef int rcl_ret_t, rmw_ret_t;
typedef struct { int unused; } rcl_allocator_t, rcl_node_t, rcl_subscription_t, rcl_publisher_t;
typedef struct { int unused; } rcl_context_t, rclc_executor_t;
typedef struct { rcl_context_t context; } rclc_support_t;
typedef struct { int unused; } rosidl_message_type_support_t;
typedef enum { ON_NEW_DATA, ALWAYS } rclc_executor_handle_invocation_t;
typedef void (*rclc_subscription_callback_t)(const void *);

rcl_allocator_t rcl_get_default_allocator(void);
rcl_node_t rcl_get_zero_initialized_node(void);
rcl_subscription_t rcl_get_zero_initialized_subscription(void);
rcl_publisher_t rcl_get_zero_initialized_publisher(void);
rclc_executor_t rclc_executor_get_zero_initialized_executor(void);
rcl_ret_t rclc_support_init(rclc_support_t *, int, char const *const *, rcl_allocator_t *);
rcl_ret_t rclc_support_fini(rclc_support_t *);
rcl_ret_t rclc_node_init_default(rcl_node_t *, const char *, const char *, rclc_support_t *);
rcl_ret_t rcl_node_fini(rcl_node_t *);
rcl_ret_t rclc_subscription_init_default(rcl_subscription_t *, rcl_node_t *, const rosidl_message_type_support_t *,
                                         const char *);
rcl_ret_t rcl_subscription_fini(rcl_subscription_t *, rcl_node_t *);
rcl_ret_t rclc_publisher_init_default(rcl_publisher_t *, const rcl_node_t *, const rosidl_message_type_support_t *,
                                      const char *);
rcl_ret_t rcl_publisher_fini(rcl_publisher_t *, rcl_node_t *);
rcl_ret_t rcl_publish(const rcl_publisher_t *, const void *, void *);
rcl_ret_t rclc_executor_init(rclc_executor_t *, rcl_context_t *, size_t, const rcl_allocator_t *);
rcl_ret_t rclc_executor_fini(rclc_executor_t *);
rcl_ret_t rclc_executor_add_subscription(rclc_executor_t *, rcl_subscription_t *, void *, rclc_subscription_callback_t,
                                         rclc_executor_handle_invocation_t);
rcl_ret_t rclc_executor_spin_some(rclc_executor_t *, uint64_t);
rmw_ret_t rmw_uros_sync_session(int);
rmw_ret_t rmw_uros_ping_agent(int, uint8_t);
int64_t rmw_uros_epoch_nanos(void);

#define ROSIDL_GET_MSG_TYPE_SUPPORT(package, kind, name) support_of_##package##_##name()
const rosidl_message_type_support_t *support_of_geometry_msgs_Twist(void), *support_of_nav_msgs_Odometry(void);

typedef struct { double x, y, z; } vector;
typedef struct { double x, y, z, w; } quaternion;
typedef struct { vector linear, angular; } geometry_msgs__msg__Twist;
typedef struct { char *data; size_t size, capacity; } string;
typedef struct {
    struct { struct { int32_t sec; uint32_t nanosec; } stamp; string frame_id; } header;
    string child_frame_id;
    struct { struct { vector position; quaternion orientation; } pose; double covariance[36]; } pose;
    struct { geometry_msgs__msg__Twist twist; double covariance[36]; } twist;
} nav_msgs__msg__Odometry;
#endif
