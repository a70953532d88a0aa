require("fawkes.modinit")
module(..., fawkes.modinit.register_all)
skillenv.use_skill("skills.hello.greet")
