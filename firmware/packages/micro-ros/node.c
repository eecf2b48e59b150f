/* A micro-ROS node around the control task of base.h. Commands and poses are copied with interrupts off, because the
 * task runs in a timer's interrupt. */
#include "node.h"

#include <geometry_msgs/msg/twist.h>
#include <math.h>
#include <nav_msgs/msg/odometry.h>
#include <rclc/executor.h>
#include <rclc/rclc.h>
#include <rmw_microros/rmw_microros.h>

enum { PUBLISHED_MS = 20, ANSWER_MS = 100, CHECKED = 50 /* publications between two pings of the agent */ };

static omni_twist newest;
static bool arrived;
static omni4_drive_output latest;

/* Of base.h; in the interrupt. */
bool read_command(omni_twist *command) {
    const bool now = arrived;
    *command = newest;
    arrived = false;
    return now;
}

void node_period(void) {
    base_period();
    latest = base_output;
}

static void on_command(const void *message) {
    const geometry_msgs__msg__Twist *twist = message;
    interrupts_off();
    newest = (omni_twist){(float)twist->linear.x, (float)twist->linear.y, (float)twist->angular.z};
    arrived = true;
    interrupts_on();
}

static void fill(nav_msgs__msg__Odometry *odometry) {
    static char parent[] = "odom", child[] = "base_link";
    const int64_t now_ns = rmw_uros_epoch_nanos();
    omni4_drive_output output;
    interrupts_off();
    output = latest;
    interrupts_on();
    odometry->header.stamp.sec = (int32_t)(now_ns / 1000000000);
    odometry->header.stamp.nanosec = (uint32_t)(now_ns % 1000000000);
    odometry->header.frame_id.data = parent;
    odometry->header.frame_id.size = sizeof parent - 1;
    odometry->header.frame_id.capacity = sizeof parent;
    odometry->child_frame_id.data = child;
    odometry->child_frame_id.size = sizeof child - 1;
    odometry->child_frame_id.capacity = sizeof child;
    odometry->pose.pose.position.x = output.pose.x_m;
    odometry->pose.pose.position.y = output.pose.y_m;
    odometry->pose.pose.orientation.z = sinf(output.pose.yaw_rad / 2.0f);
    odometry->pose.pose.orientation.w = cosf(output.pose.yaw_rad / 2.0f);
    odometry->twist.twist.linear.x = output.estimated.vx_m_s;
    odometry->twist.twist.linear.y = output.estimated.vy_m_s;
    odometry->twist.twist.angular.z = output.estimated.wz_rad_s;
}

/* Until the agent is lost. */
static void publish(rclc_executor_t *executor, rcl_publisher_t *publisher) {
    static nav_msgs__msg__Odometry odometry;
    for (int published = 1;; published++) {
        rclc_executor_spin_some(executor, RCL_MS_TO_NS(PUBLISHED_MS));
        fill(&odometry);
        if (rcl_publish(publisher, &odometry, NULL) != RCL_RET_OK ||
            (published % CHECKED == 0 && rmw_uros_ping_agent(ANSWER_MS, 1) != RMW_RET_OK)) {
            return;
        }
    }
}

bool node_run(void) {
    static geometry_msgs__msg__Twist command;
    const rosidl_message_type_support_t *twist = ROSIDL_GET_MSG_TYPE_SUPPORT(geometry_msgs, msg, Twist);
    const rosidl_message_type_support_t *odometry = ROSIDL_GET_MSG_TYPE_SUPPORT(nav_msgs, msg, Odometry);
    rcl_allocator_t allocator = rcl_get_default_allocator();
    rclc_support_t support;
    rcl_node_t node = rcl_get_zero_initialized_node();
    rcl_subscription_t subscription = rcl_get_zero_initialized_subscription();
    rcl_publisher_t publisher = rcl_get_zero_initialized_publisher();
    rclc_executor_t executor = rclc_executor_get_zero_initialized_executor();
    if (rclc_support_init(&support, 0, NULL, &allocator) != RCL_RET_OK) {
        return false;
    }
    bool good = rmw_uros_sync_session(ANSWER_MS) == RMW_RET_OK;
    good = good && rclc_node_init_default(&node, "omnistep", "", &support) == RCL_RET_OK;
    good = good && rclc_subscription_init_default(&subscription, &node, twist, "cmd_vel") == RCL_RET_OK;
    /* Reliable: the message is longer than one packet of the transport, which best effort would not divide. */
    good = good && rclc_publisher_init_default(&publisher, &node, odometry, "odom") == RCL_RET_OK;
    good = good && rclc_executor_init(&executor, &support.context, 1, &allocator) == RCL_RET_OK;
    good = good && rclc_executor_add_subscription(&executor, &subscription, &command, on_command, ON_NEW_DATA) ==
                       RCL_RET_OK;
    if (good) {
        publish(&executor, &publisher);
    }
    /* What was not initialised is left alone by these. */
    (void)rclc_executor_fini(&executor);
    (void)rcl_publisher_fini(&publisher, &node);
    (void)rcl_subscription_fini(&subscription, &node);
    (void)rcl_node_fini(&node);
    (void)rclc_support_fini(&support);
    return false;
}
