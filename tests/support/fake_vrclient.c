/* A SteamVR for tests: the client library that libopenvr_api loads as bin/linux64/vrclient.so.
 *
 * What it plays is a file, mapped here and in the test (support/steamvr_bed.py declares the same
 * structs): the test writes devices, events and settings, this side writes down what it was asked.
 * Test and driver are one process and one thread, so no lock is needed.
 *
 * The position of a function in SteamVR's tables changes between its versions; SLOT_* and *_SLOTS
 * come from the package under test, on the compiler's command line. A function that is not played
 * ends the process with a message, so that a new call in the driver cannot pass unnoticed.
 */
#define _POSIX_C_SOURCE 200809L
#include <fcntl.h>
#include <stdbool.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

enum { DEVICES = 64, EVENTS = 512, SETTINGS = 8 };
enum { INIT_HMD_NOT_FOUND = 108, INIT_INTERFACE_NOT_FOUND = 105, INIT_INVALID_INTERFACE = 106 };
enum { PROP_BUFFER_TOO_SMALL = 3, PROP_UNKNOWN = 4, PROP_INVALID_DEVICE = 5 };
enum { SETTING_UNSET = 5 };
enum { MODEL = 1001, SERIAL = 1002, FIRMWARE = 1006, BATTERY = 1012, REGISTERED = 1036, TYPE = 7000 };

typedef struct {
    int32_t device_class, hand, result, activity;
    uint8_t connected, valid, unused[2];
    float T[12], velocity[3], spin[3];
    float battery; /* negative: has none */
    char serial[32], model[32], firmware[32], controller_type[64], registered_type[64];
} device;

typedef struct {
    uint32_t type, device;
    float age_s;
    uint32_t button;
} event;

typedef struct {
    char key[128], value[64];
} setting;

typedef struct {
    /* the test writes */
    int32_t init_error;
    int32_t hidden_interface; /* 1: IVRSystem, 2: IVRSettings */
    uint32_t events_raised;
    event events[EVENTS];
    setting trackers[SETTINGS];
    device devices[DEVICES];
    /* the runtime writes */
    int32_t app_type, origin;
    float predicted_s;
    uint32_t inits, cleanups, quits_acknowledged, poses_asked, events_read;
} stage;

typedef struct {
    float T[12], velocity[3], spin[3];
    int32_t result;
    bool valid, connected;
} pose; /* TrackedDevicePose_t */
_Static_assert(sizeof(pose) == 80, "as in openvr");

static stage *now;
static void *system_table[SYSTEM_SLOTS];
static void *settings_table[SETTINGS_SLOTS];

static void not_played(void) {
    fputs("fake SteamVR: a function was called that it does not play\n", stderr);
    abort();
}

static const device *device_at(uint32_t index) {
    return index < DEVICES && now->devices[index].device_class ? &now->devices[index] : NULL;
}

/* ---- IVRSystem ---- */

static void get_poses(int32_t origin, float predicted_s, pose *out, uint32_t count) {
    now->poses_asked++;
    now->origin = origin;
    now->predicted_s = predicted_s;
    memset(out, 0, count * sizeof *out);
    for (uint32_t i = 0; i < count && i < DEVICES; i++) {
        const device *d = &now->devices[i];
        memcpy(out[i].T, d->T, sizeof d->T);
        memcpy(out[i].velocity, d->velocity, sizeof d->velocity);
        memcpy(out[i].spin, d->spin, sizeof d->spin);
        out[i].result = d->result;
        out[i].valid = d->valid;
        out[i].connected = d->connected;
    }
}

static int32_t get_class(uint32_t index) {
    const device *d = device_at(index);
    return d ? d->device_class : 0;
}

static int32_t get_hand(uint32_t index) {
    const device *d = device_at(index);
    return d ? d->hand : 0;
}

static int32_t get_activity(uint32_t index) {
    const device *d = device_at(index);
    return d ? d->activity : -1;
}

static const char *string_of(const device *d, int32_t property) {
    switch (property) {
    case MODEL: return d->model;
    case SERIAL: return d->serial;
    case FIRMWARE: return d->firmware;
    case REGISTERED: return d->registered_type;
    case TYPE: return d->controller_type;
    default: return "";
    }
}

static uint32_t get_string(uint32_t index, int32_t property, char *out, uint32_t size, int32_t *error) {
    const device *d = device_at(index);
    const char *found = d ? string_of(d, property) : "";
    uint32_t needed = (uint32_t)strlen(found) + 1;
    *error = !d ? PROP_INVALID_DEVICE : !*found ? PROP_UNKNOWN : needed > size ? PROP_BUFFER_TOO_SMALL : 0;
    if (*error == 0) memcpy(out, found, needed);
    return *found ? needed : 0;
}

static float get_float(uint32_t index, int32_t property, int32_t *error) {
    const device *d = device_at(index);
    bool known = d && property == BATTERY && d->battery >= 0.0f;
    *error = known ? 0 : PROP_UNKNOWN;
    return known ? d->battery : 0.0f;
}

static bool next_event(uint32_t *out, uint32_t size) {
    if (now->events_read == now->events_raised) return false;
    const event *e = &now->events[now->events_read++ % EVENTS];
    memset(out, 0, size);
    memcpy(out, e, sizeof *e); /* VREvent_t begins so; a button is the first word of its data */
    return true;
}

static void acknowledge_quit(void) { now->quits_acknowledged++; }

/* ---- IVRSettings ---- */

static void get_setting(const char *section, const char *key, char *out, uint32_t size, int32_t *error) {
    *error = SETTING_UNSET;
    snprintf(out, size, "an unset key leaves what it likes");
    if (strcmp(section, "trackers")) return;
    for (int i = 0; i < SETTINGS; i++) {
        if (strcmp(now->trackers[i].key, key) || !*key) continue;
        snprintf(out, size, "%s", now->trackers[i].value);
        *error = 0;
    }
}

/* ---- IVRClientCore_003: a C++ object of seven virtual functions, no destructor ---- */

static int32_t core_init(void *self, int32_t app_type, const char *startup_info) {
    (void)self, (void)startup_info;
    const char *path = getenv("FAKE_STEAMVR_STAGE");
    int file = open(path ? path : "", O_RDWR);
    if (file < 0) return INIT_HMD_NOT_FOUND;
    void *mapped = mmap(NULL, sizeof *now, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    if (mapped == MAP_FAILED) return INIT_HMD_NOT_FOUND;
    now = mapped;
    now->app_type = app_type;
    now->inits++;
    return now->init_error;
}

static void core_cleanup(void *self) {
    (void)self;
    if (!now) return;
    now->cleanups++;
    munmap(now, sizeof *now);
    now = NULL;
}

static bool hidden(const char *version) {
    if (!strncmp(version, "IVRSystem_", 10)) return now->hidden_interface == 1;
    if (!strncmp(version, "IVRSettings_", 12)) return now->hidden_interface == 2;
    return true;
}

static int32_t core_is_version_valid(void *self, const char *version) {
    (void)self;
    return hidden(version) ? INIT_INTERFACE_NOT_FOUND : 0;
}

static void *core_get_interface(void *self, const char *version, int32_t *error) {
    (void)self;
    const char *prefix = "FnTable:";
    bool found = !strncmp(version, prefix, strlen(prefix)) && !hidden(version + strlen(prefix));
    if (error) *error = found ? 0 : INIT_INVALID_INTERFACE;
    if (!found) return NULL;
    return strstr(version, "IVRSystem_") ? (void *)system_table : (void *)settings_table;
}

static bool core_headset_present(void *self) {
    (void)self;
    return true;
}

static const char *core_error_text(void *self, int32_t error) {
    (void)self, (void)error;
    return "fake";
}

static void *virtual_functions[] = {core_init,          core_cleanup,         core_is_version_valid,
                                    core_get_interface, core_headset_present, core_error_text,
                                    core_error_text};
static void *core[] = {virtual_functions};

static void fill_tables(void) {
    for (int i = 0; i < SYSTEM_SLOTS; i++) system_table[i] = not_played;
    for (int i = 0; i < SETTINGS_SLOTS; i++) settings_table[i] = not_played;
    system_table[SLOT_getDeviceToAbsoluteTrackingPose] = get_poses;
    system_table[SLOT_getTrackedDeviceActivityLevel] = get_activity;
    system_table[SLOT_getControllerRoleForTrackedDeviceIndex] = get_hand;
    system_table[SLOT_getTrackedDeviceClass] = get_class;
    system_table[SLOT_getFloatTrackedDeviceProperty] = get_float;
    system_table[SLOT_getStringTrackedDeviceProperty] = get_string;
    system_table[SLOT_pollNextEvent] = next_event;
    system_table[SLOT_acknowledgeQuit_Exiting] = acknowledge_quit;
    settings_table[SLOT_getString] = get_setting;
}

__attribute__((visibility("default"))) void *VRClientCoreFactory(const char *name, int *result) {
    fill_tables();
    bool known = !strcmp(name, "IVRClientCore_003");
    if (result) *result = known ? 0 : INIT_INTERFACE_NOT_FOUND;
    return known ? core : NULL;
}
