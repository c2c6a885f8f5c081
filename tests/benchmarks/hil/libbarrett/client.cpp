/* A client of a Proficio that is written with Barrett's library; says what it sees, one fact a line: `name value ...`.

   client frames COUNT    packs and parses COUNT random frames of each kind, without a bus
   client robot CONFIG    enumeration, properties, limits, sensor, torques of a low-level arm
   client loop CONFIG S   the library's own Wam<3>, holding a posture for S seconds */
#include <cstdio>
#include <cstdlib>
#include <stdexcept>
#include <string>
#include <vector>

#include <barrett/os.h>
#include <barrett/products/force_torque_sensor.h>
#include <barrett/products/low_level_wam.h>
#include <barrett/products/motor_puck.h>
#include <barrett/products/product_manager.h>
#include <barrett/products/puck_group.h>
#include <barrett/products/safety_module.h>
#include <barrett/systems.h>
#include <barrett/systems/wam.h>
#include <barrett/thread/null_mutex.h>

using namespace barrett;

/* Takes what is sent, and keeps it. */
class Paper : public bus::CommunicationsBus {
public:
    mutable std::vector<unsigned char> last;
    mutable int identifier;
    thread::NullMutex mutex;
    virtual thread::Mutex &getMutex() const { return const_cast<thread::NullMutex &>(mutex); }
    virtual void open(int) {}
    virtual void close() {}
    virtual bool isOpen() const { return true; }
    virtual int send(int id, const unsigned char *data, size_t length) const {
        identifier = id;
        last.assign(data, data + length);
        return 0;
    }
    virtual int receiveRaw(int &, unsigned char *, size_t &, bool) const { return 1; }
};

static void show(const std::vector<unsigned char> &data) {
    for (size_t i = 0; i < data.size(); i++) printf("%02X", data[i]);
}

static std::vector<unsigned char> random_bytes(size_t length) {
    std::vector<unsigned char> data(length);
    for (size_t i = 0; i < length; i++) data[i] = rand() & 0xFF;
    return data;
}

static int frames(int count) {
    Paper paper;
    srand(1);
    for (int k = 0; k < count; k++) {
        double torques[4];
        for (int i = 0; i < 4; i++) torques[i] = (rand() / (double)RAND_MAX - 0.5) * 20000.0;
        MotorPuck::sendPackedTorques(paper, PuckGroup::BGRP_LOWER_WAM, 42, torques, 4);
        printf("torques %03X ", paper.identifier);
        show(paper.last);
        printf(" %.17g %.17g %.17g %.17g\n", torques[0], torques[1], torques[2], torques[3]);
        std::vector<unsigned char> position = random_bytes(3), force = random_bytes(6);
        int counts = 0;
        MotorPuck::MotorPositionParser<int>::parse(1, 0, &counts, &position[0], position.size());
        printf("position ");
        show(position);
        printf(" %d\nforce ", counts);
        ForceTorqueSensor::ForceParser::result_type found;
        ForceTorqueSensor::ForceParser::parse(8, 0, &found, &force[0], force.size());
        show(force);
        printf(" %.17g %.17g %.17g\n", found[0], found[1], found[2]);
    }
    return 0;
}

static void show(const char *name, const math::Matrix<3, 1> &v) { printf("%s %.9f %.9f %.9f\n", name, v[0], v[1], v[2]); }

static void properties(Puck &puck) {
    const enum Puck::Property asked[] = {Puck::CTS, Puck::IPNM, Puck::GRPA, Puck::GRPB, Puck::GRPC, Puck::MODE,
                                         Puck::STAT, Puck::TEMP, Puck::VBUS, Puck::POLES, Puck::ERROR};
    const char *names[] = {"CTS", "IPNM", "GRPA", "GRPB", "GRPC", "MODE", "STAT", "TEMP", "VBUS", "POLES", "ERROR"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        printf("property %d %s %d\n", puck.getId(), names[i], puck.getProperty(asked[i]));
}

static void limits(ProductManager &manager, const char *when) {
    Puck &module = *manager.getPuck(10);
    printf("%s VL1 %d VL2 %d TL1 %d TL2 %d\n", when, module.getProperty(Puck::VL1), module.getProperty(Puck::VL2),
           module.getProperty(Puck::TL1), module.getProperty(Puck::TL2));
}

static void torques(LowLevelWam<3> &arm, std::vector<Puck *> &motors) {
    const double wanted[][3] = {{0, 0, 0}, {5, -3, 2}, {-10, 4, -1}, {1.3, -5.2, -2.2}, {0, 0, 0}};
    for (size_t k = 0; k < sizeof wanted / sizeof *wanted; k++) {
        units::JointTorques<3>::type each;
        for (int i = 0; i < 3; i++) each[i] = wanted[k][i];
        arm.setTorques(each);
        arm.update();
        printf("asked %g %g %g heard", wanted[k][0], wanted[k][1], wanted[k][2]);
        for (int i = 0; i < 3; i++) printf(" %d", motors[i]->getProperty(Puck::T));
        printf("\n");
    }
}

/* The library's enumeration waits some milliseconds for answers; a motor that was too late is not there for it. */
static std::vector<Puck *> motors_of(ProductManager &manager) {
    std::vector<Puck *> motors = manager.getWamPucks();
    motors.resize(3);
    for (int i = 0; i < 3; i++)
        if (!motors[i]) throw std::runtime_error("a motor answered too late to be enumerated");
    return motors;
}

static int robot(const char *config) {
    ProductManager &manager = *new ProductManager(config); /* not destroyed: its threads may still run */
    printf("found wam3 %d wam4 %d wam7 %d module %d sensor %d hand %d\n", manager.foundWam3(), manager.foundWam4(),
           manager.foundWam7(), manager.foundSafetyModule(), manager.foundForceTorqueSensor(), manager.foundHand());
    for (int id = 1; id <= 31; id++)
        if (Puck *puck = manager.getPuck(id))
            printf("puck %d %s version %d\n", id, Puck::getPuckTypeStr(puck->getEffectiveType()), puck->getVers());
    std::vector<Puck *> motors = motors_of(manager);
    Puck::wake(motors);
    for (int i = 0; i < 3; i++) properties(*motors[i]);
    manager.waitForWam(false);
    SafetyModule &module = *manager.getSafetyModule();
    printf("zeroed %d mode %d\n", module.wamIsZeroed(), module.getMode());
    limits(manager, "limits");
    module.setTorqueLimit(1.5);
    module.setVelocityLimit(0.8);
    limits(manager, "changed");
    module.setDefaultSafetyLimits();
    limits(manager, "restored");
    ForceTorqueSensor &sensor = *manager.getForceTorqueSensor();
    sensor.update();
    show("force", sensor.getForce());
    LowLevelWam<3> arm(motors, &module, manager.getConfig().lookup("wam3.low_level"));
    show("angles", arm.getJointPositions());
    torques(arm, motors);
    return 0;
}

static int loop(const char *config, double seconds) {
    ProductManager &manager = *new ProductManager(config); /* not destroyed: its threads may still run */
    std::vector<Puck *> motors = motors_of(manager);
    Puck::wake(motors);
    manager.waitForWam(false);
    systems::Wam<3> &arm = *manager.getWam3(false);
    manager.getSafetyModule()->waitForMode(SafetyModule::ACTIVE, true, 0.05);
    show("start", arm.getJointPositions());
    units::JointPositions<3>::type there = arm.getJointPositions();
    there[2] -= 0.2;
    arm.moveTo(there, false);
    btsleep(seconds);
    show("wanted", there);
    show("reached", arm.getJointPositions());
    arm.idle();
    manager.getExecutionManager()->stop();
    manager.getSafetyModule()->setMode(SafetyModule::IDLE);
    printf("mode %d\n", manager.getSafetyModule()->getMode());
    return 0;
}

int main(int argc, char **argv) {
    const std::string what = argc > 2 ? argv[1] : "";
    int code = 2;
    try {
        if (what == "frames") code = frames(atoi(argv[2]));
        if (what == "robot") code = robot(argv[2]);
        if (what == "loop") code = loop(argv[2], argc > 3 ? atof(argv[3]) : 3.0);
    } catch (const std::exception &error) {
        printf("failed %s\n", error.what());
        code = 3;
    }
    fflush(stdout);
    _exit(code); /* the library's threads need not be waited for */
}
