/* An OpenXR runtime for tests, loaded by the real Khronos loader through XR_RUNTIME_JSON.
 *
 * What it plays is a file, mapped here and in the test (support/openxr_bed.py declares the same
 * structs). Test and driver are one process and one thread, so no lock is needed. It is strict where
 * a real runtime is: quaternions must be unit, nothing is attached twice, a session begins only when
 * ready. A function that is not played does not exist for the loader.
 */
#define _POSIX_C_SOURCE 200809L
#define XR_USE_TIMESPEC
#include <fcntl.h>
#include <math.h>
#include <stdint.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#include <openxr/openxr.h>
#include <openxr/openxr_platform.h>

enum { PLACES = 16, XDEVS = 8, MESSAGES = 64, BUTTONS = 6 };
enum { PATHS = 256, PATH_BYTES = 256, SPACES = 128, ACTIONS = 32, BINDINGS = 256 };

typedef struct {
    char path[64];       /* /user/head, /user/hand/left, a role path, or empty: an xdev's slot */
    char persistent[64]; /* of a Vive tracker */
    int32_t connected;
    uint32_t flags; /* of its location */
    float p[3], quat_xyzw[4], velocity[3];
    int32_t has_velocity;
    uint32_t pressed[BUTTONS]; /* in the order of the actions' creation */
    int64_t changed_ns;
} place;

typedef struct {
    char name[64], serial[64];
    int32_t there, can_create_space, place;
} xdev;

typedef struct {
    uint32_t kind; /* XrStructureType */
    int32_t value; /* session state, or reference space type */
} message;

typedef struct {
    /* the test writes */
    int32_t refuse_instance, refuse_system, refuse_session, refuse_locate; /* XrResult */
    uint32_t without;   /* bits: 1 headless, 2 clock, 4 Vive trackers, 8 xdevs, 16 stage */
    uint32_t messages_sent;
    int32_t focus_withheld, focus_lost_unsaid;
    uint32_t xdev_generation;
    int64_t clock_offset_ns;
    message messages[MESSAGES];
    place places[PLACES];
    xdev xdevs[XDEVS];
    /* the runtime writes */
    uint32_t instances, destroyed, sessions, begun, ended, syncs, located, messages_read;
    uint32_t profiles_suggested, bindings_suggested;
    int64_t last_time_ns;
    int32_t base_space;
} stage;

static stage *now;
static char paths[PATHS][PATH_BYTES];
static uint32_t path_count;
static struct { int kind, place; XrPath path; } spaces[SPACES]; /* kind: a reference type, or 0 */
static uint32_t space_count, action_count;
static place synced[PLACES]; /* what actions tell: as it was at the last sync */
static int state, attached, running, alive;
static int own[MESSAGES];
static uint32_t own_sent, own_read;

static void become(int next) { own[own_sent++ % MESSAGES] = next; }

static int fails(XrPosef pose) {
    XrQuaternionf q = pose.orientation;
    return fabsf(q.x * q.x + q.y * q.y + q.z * q.z + q.w * q.w - 1.0f) > 0.01f;
}

/* ---- instance ---- */

static void leave_stage(void) {
    if (now) munmap(now, sizeof *now);
    now = NULL;
}

/* The first call of all is for the extensions, before any instance. */
static int find_stage(void) {
    leave_stage();
    const char *path = getenv("FAKE_OPENXR_STAGE");
    int file = open(path ? path : "", O_RDWR);
    if (file < 0) return 0;
    void *mapped = mmap(NULL, sizeof *now, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
    close(file);
    now = mapped == MAP_FAILED ? NULL : mapped;
    return now != NULL;
}

static XrResult XRAPI_CALL list_extensions(const char *layer, uint32_t capacity, uint32_t *count,
                                           XrExtensionProperties *out) {
    static const char *names[] = {"XR_MND_headless", "XR_KHR_convert_timespec_time",
                                  "XR_HTCX_vive_tracker_interaction", "XR_MNDX_xdev_space"};
    (void)layer;
    if (!alive && !find_stage()) return XR_ERROR_RUNTIME_FAILURE;
    uint32_t n = 0;
    for (uint32_t i = 0; i < 4; i++) {
        if (now->without & (1u << i)) continue;
        if (n < capacity) {
            snprintf(out[n].extensionName, sizeof out[n].extensionName, "%s", names[i]);
            out[n].extensionVersion = 1;
        }
        n++;
    }
    *count = n;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL create_instance(const XrInstanceCreateInfo *info, XrInstance *out) {
    if (!now) return XR_ERROR_RUNTIME_FAILURE;
    if (now->refuse_instance) return now->refuse_instance;
    for (uint32_t i = 0; i < info->enabledExtensionCount; i++) {
        uint32_t count = 0;
        XrExtensionProperties offered[4];
        memset(offered, 0, sizeof offered);
        list_extensions(NULL, 4, &count, offered);
        int found = 0;
        for (uint32_t k = 0; k < count; k++)
            found |= !strcmp(offered[k].extensionName, info->enabledExtensionNames[i]);
        /* the loader adds one of its own */
        if (!found && strcmp(info->enabledExtensionNames[i], "XR_EXT_debug_utils"))
            return XR_ERROR_EXTENSION_NOT_PRESENT;
    }
    path_count = space_count = action_count = own_sent = own_read = 0;
    attached = running = 0;
    memset(synced, 0, sizeof synced);
    alive = 1;
    state = XR_SESSION_STATE_UNKNOWN;
    now->instances++;
    *out = (XrInstance)now;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL destroy_instance(XrInstance instance) {
    (void)instance;
    now->destroyed++;
    alive = 0;
    leave_stage();
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL instance_properties(XrInstance instance, XrInstanceProperties *out) {
    (void)instance;
    snprintf(out->runtimeName, sizeof out->runtimeName, "fake");
    out->runtimeVersion = XR_MAKE_VERSION(1, 0, 0);
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL get_system(XrInstance instance, const XrSystemGetInfo *info,
                                      XrSystemId *out) {
    (void)instance;
    if (info->formFactor != XR_FORM_FACTOR_HEAD_MOUNTED_DISPLAY)
        return XR_ERROR_FORM_FACTOR_UNSUPPORTED;
    *out = 1;
    return now->refuse_system;
}

static XrResult XRAPI_CALL system_properties(XrInstance instance, XrSystemId system,
                                             XrSystemProperties *out) {
    (void)instance, (void)system;
    snprintf(out->systemName, sizeof out->systemName, "a headset");
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL string_to_path(XrInstance instance, const char *text, XrPath *out) {
    (void)instance;
    for (uint32_t i = 0; i < path_count; i++)
        if (!strcmp(paths[i], text)) return *out = i + 1, XR_SUCCESS;
    if (path_count == PATHS) return XR_ERROR_PATH_COUNT_EXCEEDED;
    if (*text != '/') return XR_ERROR_PATH_FORMAT_INVALID;
    snprintf(paths[path_count], PATH_BYTES, "%s", text);
    *out = ++path_count;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL path_to_string(XrInstance instance, XrPath path, uint32_t capacity,
                                          uint32_t *count, char *out) {
    (void)instance;
    if (path < 1 || path > path_count) return XR_ERROR_PATH_INVALID;
    *count = (uint32_t)strlen(paths[path - 1]) + 1;
    if (capacity && capacity < *count) return XR_ERROR_SIZE_INSUFFICIENT;
    if (capacity) memcpy(out, paths[path - 1], *count);
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL result_to_string(XrInstance instance, XrResult value, char *out) {
    (void)instance;
    snprintf(out, XR_MAX_RESULT_STRING_SIZE, "result %d", value);
    return XR_SUCCESS;
}

/* ---- session ---- */

static XrResult XRAPI_CALL create_session(XrInstance instance, const XrSessionCreateInfo *info,
                                          XrSession *out) {
    (void)instance;
    if (info->systemId != 1) return XR_ERROR_SYSTEM_INVALID;
    if (now->refuse_session) return now->refuse_session;
    now->sessions++;
    become(XR_SESSION_STATE_IDLE);
    become(XR_SESSION_STATE_READY);
    *out = (XrSession)&state;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL begin_session(XrSession session, const XrSessionBeginInfo *info) {
    (void)session, (void)info;
    if (state != XR_SESSION_STATE_READY) return XR_ERROR_SESSION_NOT_READY;
    now->begun++;
    running = 1;
    become(XR_SESSION_STATE_SYNCHRONIZED);
    if (now->focus_withheld) return XR_SUCCESS;
    become(XR_SESSION_STATE_VISIBLE);
    become(XR_SESSION_STATE_FOCUSED);
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL end_session(XrSession session) {
    (void)session;
    if (state != XR_SESSION_STATE_STOPPING) return XR_ERROR_SESSION_NOT_STOPPING;
    now->ended++;
    running = 0;
    become(XR_SESSION_STATE_IDLE);
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL poll_event(XrInstance instance, XrEventDataBuffer *out) {
    (void)instance;
    message next = {XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED, 0};
    if (own_read != own_sent)
        next.value = own[own_read++ % MESSAGES];
    else if (now->messages_read != now->messages_sent)
        next = now->messages[now->messages_read++ % MESSAGES];
    else
        return XR_EVENT_UNAVAILABLE;
    memset(out, 0, sizeof *out);
    out->type = (XrStructureType)next.kind;
    if (next.kind == XR_TYPE_EVENT_DATA_SESSION_STATE_CHANGED) {
        ((XrEventDataSessionStateChanged *)out)->session = (XrSession)&state;
        ((XrEventDataSessionStateChanged *)out)->state = state = next.value;
    }
    if (next.kind == XR_TYPE_EVENT_DATA_REFERENCE_SPACE_CHANGE_PENDING)
        ((XrEventDataReferenceSpaceChangePending *)out)->referenceSpaceType = next.value;
    return XR_SUCCESS;
}

/* ---- spaces ---- */

static XrResult new_space(int kind, int where, XrPath path, XrSpace *out) {
    if (space_count == SPACES) return XR_ERROR_LIMIT_REACHED;
    spaces[space_count].kind = kind;
    spaces[space_count].place = where;
    spaces[space_count].path = path;
    *out = (XrSpace)&spaces[space_count++];
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL create_reference_space(XrSession session,
                                                  const XrReferenceSpaceCreateInfo *info,
                                                  XrSpace *out) {
    (void)session;
    if (fails(info->poseInReferenceSpace)) return XR_ERROR_POSE_INVALID;
    if (info->referenceSpaceType == XR_REFERENCE_SPACE_TYPE_STAGE && now->without & 16)
        return XR_ERROR_REFERENCE_SPACE_UNSUPPORTED;
    return new_space(info->referenceSpaceType, -1, XR_NULL_PATH, out);
}

static XrResult XRAPI_CALL create_action_space(XrSession session,
                                               const XrActionSpaceCreateInfo *info, XrSpace *out) {
    (void)session;
    if (fails(info->poseInActionSpace)) return XR_ERROR_POSE_INVALID;
    return new_space(0, -1, info->subactionPath, out);
}

static const place *place_in(const place *places, const char *path) {
    for (int i = 0; i < PLACES; i++)
        if (*path && !strcmp(places[i].path, path)) return &places[i];
    return NULL;
}

static const place *place_of(XrSpace space) {
    uint32_t i = (uint32_t)((__typeof__(&spaces[0]))space - spaces);
    if (spaces[i].kind == XR_REFERENCE_SPACE_TYPE_VIEW) return place_in(now->places, "/user/head");
    if (spaces[i].place >= 0) return &now->places[spaces[i].place];
    return spaces[i].path ? place_in(now->places, paths[spaces[i].path - 1]) : NULL;
}

static XrResult XRAPI_CALL locate_space(XrSpace space, XrSpace base, XrTime time,
                                        XrSpaceLocation *out) {
    if (now->refuse_locate) return now->refuse_locate;
    if (time <= 0) return XR_ERROR_TIME_INVALID;
    now->located++;
    now->last_time_ns = time;
    now->base_space = spaces[(__typeof__(&spaces[0]))base - spaces].kind;
    out->locationFlags = 0;
    const place *found = place_of(space);
    if (!running || !found || !found->connected) return XR_SUCCESS;
    out->locationFlags = found->flags;
    memcpy(&out->pose.position, found->p, sizeof found->p);
    memcpy(&out->pose.orientation, found->quat_xyzw, sizeof found->quat_xyzw);
    XrSpaceVelocity *velocity = out->next;
    if (velocity && velocity->type == XR_TYPE_SPACE_VELOCITY && found->has_velocity) {
        velocity->velocityFlags = XR_SPACE_VELOCITY_LINEAR_VALID_BIT;
        memcpy(&velocity->linearVelocity, found->velocity, sizeof found->velocity);
    }
    return XR_SUCCESS;
}

/* ---- actions ---- */

static XrResult XRAPI_CALL create_action_set(XrInstance instance,
                                             const XrActionSetCreateInfo *info, XrActionSet *out) {
    (void)instance, (void)info;
    *out = (XrActionSet)&action_count;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL create_action(XrActionSet set, const XrActionCreateInfo *info,
                                         XrAction *out) {
    (void)set;
    if (attached) return XR_ERROR_ACTIONSETS_ALREADY_ATTACHED;
    for (const char *c = info->actionName; *c; c++)
        if ((*c < 'a' || *c > 'z') && *c != '_') return XR_ERROR_PATH_FORMAT_INVALID;
    if (!*info->localizedActionName) return XR_ERROR_LOCALIZED_NAME_INVALID;
    *out = (XrAction)(uintptr_t)++action_count; /* 1: the pose, 2 and up: buttons */
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL suggest(XrInstance instance,
                                   const XrInteractionProfileSuggestedBinding *info) {
    (void)instance;
    if (attached) return XR_ERROR_ACTIONSETS_ALREADY_ATTACHED;
    const char *profile = paths[info->interactionProfile - 1];
    if (strstr(profile, "motion_controller")) return XR_ERROR_PATH_UNSUPPORTED;
    now->profiles_suggested++;
    now->bindings_suggested += info->countSuggestedBindings;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL attach(XrSession session, const XrSessionActionSetsAttachInfo *info) {
    (void)session;
    if (attached) return XR_ERROR_ACTIONSETS_ALREADY_ATTACHED;
    attached = info->countActionSets == 1;
    return attached ? XR_SUCCESS : XR_ERROR_VALIDATION_FAILURE;
}

static XrResult XRAPI_CALL sync_actions(XrSession session, const XrActionsSyncInfo *info) {
    (void)session;
    if (!attached || info->countActiveActionSets != 1) return XR_ERROR_ACTIONSET_NOT_ATTACHED;
    now->syncs++;
    int focused = state == XR_SESSION_STATE_FOCUSED && !now->focus_lost_unsaid;
    if (focused) memcpy(synced, now->places, sizeof synced);
    return focused ? XR_SUCCESS : XR_SESSION_NOT_FOCUSED;
}

static XrResult XRAPI_CALL action_pose(XrSession session, const XrActionStateGetInfo *info,
                                       XrActionStatePose *out) {
    (void)session;
    const place *found = place_in(synced, paths[info->subactionPath - 1]);
    out->isActive = state == XR_SESSION_STATE_FOCUSED && found && found->connected;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL action_boolean(XrSession session, const XrActionStateGetInfo *info,
                                          XrActionStateBoolean *out) {
    (void)session;
    uintptr_t button = (uintptr_t)info->action - 2;
    if (button >= BUTTONS) return XR_ERROR_ACTION_TYPE_MISMATCH;
    const place *found = place_in(synced, paths[info->subactionPath - 1]);
    out->isActive = state == XR_SESSION_STATE_FOCUSED && found && found->connected;
    out->currentState = out->isActive && found->pressed[button];
    out->lastChangeTime = found ? found->changed_ns : 0;
    return XR_SUCCESS;
}

/* ---- extensions ---- */

static XrResult XRAPI_CALL from_timespec(XrInstance instance, const struct timespec *host,
                                         XrTime *out) {
    (void)instance;
    *out = host->tv_sec * 1000000000LL + host->tv_nsec + now->clock_offset_ns;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL list_vive_trackers(XrInstance instance, uint32_t capacity,
                                              uint32_t *count, XrViveTrackerPathsHTCX *out) {
    uint32_t n = 0;
    for (int i = 0; i < PLACES; i++) {
        const place *p = &now->places[i];
        if (!*p->persistent || !p->connected) continue;
        if (n < capacity) {
            string_to_path(instance, p->persistent, &out[n].persistentPath);
            out[n].rolePath = XR_NULL_PATH;
            if (*p->path) string_to_path(instance, p->path, &out[n].rolePath);
        }
        n++;
    }
    *count = n;
    return XR_SUCCESS;
}

/* XR_MNDX_xdev_space, as in Monado's header */
typedef struct { XrStructureType type; const void *next; } list_info;
typedef struct { XrStructureType type; const void *next; uint64_t id; } get_info;
typedef struct {
    XrStructureType type;
    void *next;
    char name[256], serial[256];
    XrBool32 can_create_space;
} xdev_properties;
typedef struct {
    XrStructureType type;
    const void *next;
    void *list;
    uint64_t id;
    XrPosef offset;
} space_info;

static XrResult XRAPI_CALL create_xdev_list(XrSession session, const list_info *info, void **out) {
    if (session != (XrSession)&state || info->type != 1000444002) return XR_ERROR_VALIDATION_FAILURE;
    *out = now->xdevs;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL xdev_generation(void *list, uint64_t *out) {
    if (list != now->xdevs) return XR_ERROR_HANDLE_INVALID;
    *out = now->xdev_generation;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL list_xdevs(void *list, uint32_t capacity, uint32_t *count,
                                      uint64_t *out) {
    if (list != now->xdevs) return XR_ERROR_HANDLE_INVALID;
    uint32_t n = 0;
    for (uint32_t i = 0; i < XDEVS; i++) {
        if (!now->xdevs[i].there) continue;
        if (n == capacity) return XR_ERROR_SIZE_INSUFFICIENT;
        out[n++] = 100 + i;
    }
    *count = n;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL get_xdev(void *list, const get_info *info, xdev_properties *out) {
    if (list != now->xdevs || info->type != 1000444003 || out->type != 1000444004)
        return XR_ERROR_VALIDATION_FAILURE;
    const xdev *found = &now->xdevs[info->id - 100];
    snprintf(out->name, sizeof out->name, "%s", found->name);
    snprintf(out->serial, sizeof out->serial, "%s", found->serial);
    out->can_create_space = (XrBool32)found->can_create_space;
    return XR_SUCCESS;
}

static XrResult XRAPI_CALL create_xdev_space(XrSession session, const space_info *info,
                                             XrSpace *out) {
    if (session != (XrSession)&state || info->type != 1000444005 || info->list != now->xdevs)
        return XR_ERROR_VALIDATION_FAILURE;
    if (fails(info->offset)) return XR_ERROR_POSE_INVALID;
    return new_space(0, now->xdevs[info->id - 100].place, XR_NULL_PATH, out);
}

/* ---- how the loader finds all this ---- */

static XrResult XRAPI_CALL find_function(XrInstance instance, const char *name,
                                         PFN_xrVoidFunction *out);

#define PLAYED(name, function) {"xr" name, (PFN_xrVoidFunction)function}
static const struct { const char *name; PFN_xrVoidFunction function; } played[] = {
    PLAYED("GetInstanceProcAddr", find_function),
    PLAYED("EnumerateInstanceExtensionProperties", list_extensions),
    PLAYED("CreateInstance", create_instance),
    PLAYED("DestroyInstance", destroy_instance),
    PLAYED("GetInstanceProperties", instance_properties),
    PLAYED("GetSystem", get_system),
    PLAYED("GetSystemProperties", system_properties),
    PLAYED("StringToPath", string_to_path),
    PLAYED("PathToString", path_to_string),
    PLAYED("ResultToString", result_to_string),
    PLAYED("CreateSession", create_session),
    PLAYED("BeginSession", begin_session),
    PLAYED("EndSession", end_session),
    PLAYED("PollEvent", poll_event),
    PLAYED("CreateReferenceSpace", create_reference_space),
    PLAYED("CreateActionSpace", create_action_space),
    PLAYED("LocateSpace", locate_space),
    PLAYED("CreateActionSet", create_action_set),
    PLAYED("CreateAction", create_action),
    PLAYED("SuggestInteractionProfileBindings", suggest),
    PLAYED("AttachSessionActionSets", attach),
    PLAYED("SyncActions", sync_actions),
    PLAYED("GetActionStatePose", action_pose),
    PLAYED("GetActionStateBoolean", action_boolean),
    PLAYED("ConvertTimespecTimeToTimeKHR", from_timespec),
    PLAYED("EnumerateViveTrackerPathsHTCX", list_vive_trackers),
    PLAYED("CreateXDevListMNDX", create_xdev_list),
    PLAYED("GetXDevListGenerationNumberMNDX", xdev_generation),
    PLAYED("EnumerateXDevsMNDX", list_xdevs),
    PLAYED("GetXDevPropertiesMNDX", get_xdev),
    PLAYED("CreateXDevSpaceMNDX", create_xdev_space),
};

static XrResult XRAPI_CALL find_function(XrInstance instance, const char *name,
                                         PFN_xrVoidFunction *out) {
    (void)instance;
    for (size_t i = 0; i < sizeof played / sizeof *played; i++)
        if (!strcmp(played[i].name, name)) return *out = played[i].function, XR_SUCCESS;
    *out = NULL;
    return XR_ERROR_FUNCTION_UNSUPPORTED;
}

/* XrNegotiateRuntimeRequest of loader_interfaces.h */
typedef struct {
    int type;
    uint32_t version;
    size_t size;
    uint32_t interface_version;
    XrVersion api_version;
    PFN_xrGetInstanceProcAddr find;
} runtime_request;

__attribute__((visibility("default"))) XrResult
xrNegotiateLoaderRuntimeInterface(const void *loader, runtime_request *out) {
    (void)loader;
    out->interface_version = 1;
    out->api_version = XR_CURRENT_API_VERSION;
    out->find = find_function;
    return XR_SUCCESS;
}
