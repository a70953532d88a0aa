;;; The goal reasoner of the spec `test` waits for control of a Skiller. The executive for ROS 2 has
;;; neither the template nor a Skiller to control, so control counts as acquired.

(deftemplate skiller-control "Control of the Skiller, which counts as acquired."
  (slot acquired
    (type SYMBOL) (allowed-values TRUE FALSE) (default TRUE)))
