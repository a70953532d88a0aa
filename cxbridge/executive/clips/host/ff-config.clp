;;; Facts for configuration values: (config-load PREFIX) asserts one for each value.

(deftemplate confval "A value of the configuration."
  (slot path        ; the whole path, such as "/clips-executive/spec"
    (type STRING))
  (slot type
    (type SYMBOL) (allowed-values FLOAT UINT INT BOOL STRING))
  (slot value)      ; if the value is not a list
  (slot is-list
    (type SYMBOL) (allowed-values TRUE FALSE) (default FALSE))
  (multislot list-value))
