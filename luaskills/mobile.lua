-- The skill space "mobile": a robot that drives by its NavigatorInterface and has a gripper and a voice.

require("fawkes.modinit")
module(..., fawkes.modinit.register_all)

for _, skill in ipairs {
    "basic.say", "basic.wait", "basic.fail", "mobile.goto_place", "mobile.goto_waypoints", "mobile.pick", "mobile.place",
} do
    skillenv.use_skill("skills." .. skill)
end
