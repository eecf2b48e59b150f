// Opens the plugin as pluginlib does, all symbols at once, and drives a little.
#include <cstdio>
#include <dlfcn.h>

int main(int, char** arguments) {
    void* plugin = dlopen(arguments[1], RTLD_NOW | RTLD_LOCAL);
    if (plugin == nullptr) {
        std::printf("%s\n", dlerror());
        return 1;
    }
    const auto run = reinterpret_cast<float (*)()>(dlsym(plugin, "plugin_run"));
    const float torque_n_m = run == nullptr ? 0.0f : run();
    std::printf("wheel 1: %g N.m\n", static_cast<double>(torque_n_m));
    return torque_n_m > 0.0f ? 0 : 1; // forward; a NaN is not
}
