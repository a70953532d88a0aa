-- The skill space "test" of the test scenario. Each skill comes after the skills that it uses.

require("fawkes.modinit")
module(..., fawkes.modinit.register_all)

for _, skill in ipairs {"say", "wait", "fail", "moveto", "relmoveto"} do
    skillenv.use_skill("skills.basic." .. skill)
end
