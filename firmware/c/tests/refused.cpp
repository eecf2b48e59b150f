// Mistakes, each behind a name: see refused.cmake.
#include <omnistep.hpp>

#if defined(NINE_WHEELS)
void mistake(omnistep::Controller<9>& controller) { (void)controller.step({0.3f, 0.0f, 0.0f}, {}).torques_n_m(); }
#elif defined(NINE_WHEELS_IN_A_DRIVE)
void mistake(omnistep::Drive<9>& drive) { (void)drive.step(omnistep::Input<9>{}).faults(); }
#elif defined(CONSTANTS_OF_ANOTHER_COUNT)
omnistep::Controller<7> mistake(const omni3_controller& constants) { return omnistep::Controller<7>(constants); }
#elif defined(CONSTANTS_THAT_GO)
omnistep::Controller<7> mistake() { return omnistep::Controller<7>(omni7_controller{}); }
#elif defined(ANOTHER_NUMBER_OF_READINGS)
void mistake(omnistep::Controller<7>& controller, std::array<float, 6> readings) { (void)controller.step({}, readings); }
#endif
